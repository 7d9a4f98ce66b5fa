"""The texts of `messages` in Spanish. Keys and names of the mission's language stay as they are written."""

from __future__ import annotations

from collections.abc import Mapping

SPANISH: Mapping[str, str] = {
    "plain": "{text}",
    "did_you_mean": "¿quizá '{name}'?",
    "did_you_mean_one_of": "¿quizá {names}?",
    # The file.
    "file.too_large": "ocupa más de 1 MB; una misión es una página o dos",
    "file.unreadable": "no se puede leer: {reason}",
    "file.not_utf8": "no se puede leer: no es texto UTF-8; guárdalo como UTF-8",
    "file.utf16": "no se puede leer: es texto UTF-16, o no es texto; guárdalo como UTF-8",
    "file.missing": "el archivo de misión '{name}' no existe",
    "file.irregular": "el archivo de misión '{name}' no es un archivo normal",
    "file.unknown": "misión desconocida '{name}'; {advice}",
    "file.known": "hay: {names}; un archivo termina en .yaml",
    # YAML.
    "yaml.empty": "está vacío; `framerunner mission new NAME` escribe una primera misión",
    "yaml.no_mapping": "una misión empieza con 'name: ...', después 'initial: ...' y 'states:'",
    "yaml.alias": "el alias '*{name}' no está permitido; usa una plantilla",
    "yaml.depth": "hay más de {limit} niveles",
    "yaml.too_many": "tiene más de {limit} claves y valores; una misión es una página o dos",
    "yaml.key_no_word": "una clave debe ser una palabra sencilla",
    "yaml.key_twice": "'{key}' está escrito dos veces (la primera en la línea {line}); cambia uno",
    "yaml.character": "el carácter {name} no está permitido en este archivo; bórralo",
    "yaml.second_document": "hay dos documentos en este archivo; deja uno, sin la línea '---'",
    "yaml.syntax": "sintaxis de YAML: {what}",
    "yaml.second_colon": "hay otro ':' en esta línea; escribe lo que sigue en la línea siguiente",
    "yaml.open_quote": "estas comillas no se cierran; escribe otras al final",
    "yaml.sign": "'{sign}' no puede estar aquí; pon el texto entre \"comillas\"",
    "yaml.tab": "hay un tabulador; escribe espacios",
    "yaml.special_space": (
        "esta línea empieza con espacios especiales, como los copiados de una página web; escribe normales"
    ),
    "yaml.no_space": "falta un espacio después de ':'; escribe '{key}: {value}'",
    "yaml.no_dash": "empieza cada línea de una lista con '- ', debajo de la línea anterior",
    "yaml.no_colon": "falta ':'; escribe '{line}:'",
    "yaml.not_indented": "'{key}' necesita sangría, para estar debajo de la línea a la que pertenece",
    "yaml.mixed": "aquí se mezclan líneas con '- ' y sin él; escribe todas igual",
    "yaml.does_not_fit": "esta línea no encaja debajo de la anterior; ¿falta ':' o '- '?",
    "yaml.indentation": "sangría incorrecta ({spaces}); las líneas de arriba tienen {known}",
    # Structure.
    "key.beside": "'{name}' está al lado de {key}; dale más sangría",
    "key.beside_under": "'{name}' está al lado de {key}; dale más sangría, debajo de '{under}:'",
    "key.unknown": "{what} no tiene '{key}'; {advice}",
    "key.indent_state": "si es un estado, dale sangría para que esté debajo de 'states:'",
    "key.of_transition": "escríbelo en una lista debajo de 'transitions:', como '- {key}: ...'",
    "key.of_mission": "pertenece a la misión; escríbelo al principio de una línea",
    "key.listed": "tiene {names}",
    "key.names_below": "'{key}' necesita nombres debajo, como '{example}'",
    "key.name": "'{name}' no es un nombre; usa minúsculas, cifras y _, primero una letra",
    "key.list": "'{key}' debe ser una lista; empieza sus líneas con '- ', como '{example}'",
    "key.one_line": "'{key}' debe ser una línea de texto",
    "key.flag": "'{key}' es true o false, no '{text}'",
    "key.choice": "{key} desconocido '{text}'; {advice}",
    "key.choices": "puede ser {choices}",
    "mission.name": "nombre '{name}': usa minúsculas, cifras, - y _, primero una letra o una cifra",
    "mission.name_long": (
        "nombre '{name}': usa minúsculas, cifras, - y _, primero una letra o una cifra; como mucho 80"
    ),
    "state.no_lines": "el estado '{state}' necesita líneas debajo, como 'enter:' y 'transitions:'",
    "state.resume_empty": "'resume' está vacío; nombra el estado con el que seguir después de una pausa",
    "transition.form": "una transición tiene 'when: ...' y, debajo, 'to: ...'",
    "transition.dash": "quita el '-' antes de 'to' y pon 'to' debajo del 'when' anterior",
    "transition.no_target": "transición sin 'to'; nombra el estado al que lleva",
    "transition.when_empty": "'when' está vacío; quítalo para una transición en el siguiente paso",
    "action.misplaced": "'{name}' no va aquí; escríbelo debajo de 'transitions:'",
    "action.colon": "para dar un valor escribe '=': {name} = {value}",
    "action.form": "'{key}' es una lista de primitivas y asignaciones, como '- hover' y '- cmd.vel_x = 0.3'",
    "variable.state": "'{name}' parece un estado, pero está debajo de 'variables:'; pon 'states:' encima",
    "variable.value": "la variable '{name}' necesita un número, un (x, y, z), True, False o un 'texto'",
    "variable.comma": "{text} son dos números; escríbelo con punto: {point}",
    "variable.word": "escribe {word}",
    "variable.text": "escribe un texto entre comillas: '{text}'",
    # The chart.
    "extends.package_only": "extends '{name}': aquí una misión amplía una del paquete; hay: {names}",
    "extends.elsewhere": "extends '{name}': está en otra carpeta; copia ese archivo junto a este",
    "extends.circle": "extends '{name}': da vueltas en círculo o es demasiado profundo",
    "template.unused": "la plantilla '{name}' no se usa; quítala o úsala con 'use'",
    "template.unknown": "el estado '{state}' usa la plantilla desconocida '{name}'; hay: {known}",
    "template.use": "estado '{state}': 'use' no es posible dentro de una plantilla",
    "template.both": "el estado '{state}' tiene 'use' y estados propios; elige uno de los dos",
    "chart.too_many": "tiene {count} estados; el límite es {limit}",
    "chart.too_many_parts": "tiene {count} transiciones y acciones; el límite es {limit}",
    "chart.too_much_text": "tiene {count} caracteres de expresiones; el límite es {limit}",
    "target.unknown": "{what} '{name}' del estado '{state}' no es un estado; {advice}",
    "target.what": "el destino",
    "target.beside": "hay {names}",
    "mission.no_states": "no tiene 'states'; escribe 'states:' y debajo, con sangría, los estados",
    "initial.missing": "{what} no tiene 'initial'; nombra el estado en el que empieza, como '{first}'",
    "initial.unknown": "'initial' de {what} es '{name}'; {advice}",
    "initial.known": "tiene los estados {names}",
    "what.mission": "la misión",
    "what.state": "el estado '{state}'",
    "what.a_mission": "una misión",
    "what.a_transition": "una transición",
    "state.final_with_states": "el estado '{state}' es final y tiene estados; solo puede ser una cosa",
    "state.then_unreached": (
        "ninguno de los estados de '{state}' tiene 'final: true', así que nunca se llega a su 'then'"
    ),
    "state.no_superstate": "el estado '{state}' tiene 'then' o 'initial' pero no tiene estados propios",
    "state.final_resume": "el estado '{state}' es final; no hay nada que continuar, quita 'resume'",
    "state.final_more": "el estado '{state}' es final; después de su 'enter' no pasa nada",
    "state.no_way_out": (
        "el estado '{state}' no tiene salida; añade 'transitions:', o 'final: true' si es el final"
    ),
    "state.never_finishes": (
        "no termina nunca: no hay camino del estado '{state}' a un estado final; "
        "añade una transición a uno, o marca un estado con 'final: true'"
    ),
    "state.unreachable": "nunca se llega al estado '{state}'; añade una transición hacia él, o quítalo",
    "state.no_timeout": (
        "el estado '{state}' espera algo que puede no ocurrir nunca, y no tiene límite de tiempo; "
        "añade una transición como 'when: seconds_in_state > 30'"
    ),
    "transition.after_always": (
        "nunca se llega a esta transición de '{state}': la anterior se cumple siempre"
    ),
    "transition.same_guard": (
        "nunca se llega a esta transición de '{state}': la línea {line} tiene el mismo 'when'"
    ),
    "transition.hidden": (
        "esta transición de '{state}' no se toma nunca: siempre que se cumple su 'when', se cumple también "
        "el de la línea {line}, que va primero; pon esta encima, o cambia una de las dos"
    ),
    "transition.hidden_by_several": (
        "esta transición de '{state}' no se toma nunca: siempre que se cumple su 'when', se cumple también "
        "el de una anterior, que va primero; pon esta encima, o cambia una de ellas"
    ),
    "guard.never": "when '{when}' no se puede cumplir nunca: {reason}",
    "guard.constant": "siempre es falso",
    "guard.contradiction": "ningún valor de {names} lo cumple todo; ¿querías 'or' en lugar de 'and'?",
    "guard.range": "{name} nunca es {meant}; su intervalo: {range}",
    "guard.at_least": "al menos {low:g}",
    "guard.at_most": "como mucho {high:g}",
    "guard.from_to": "de {low:g} a {high:g}",
    "guard.always": "when '{when}' se cumple siempre: {reason}; quita 'when', o corrígelo",
    "guard.always_true": "es verdadero para cualquier valor",
    "detector.unknown": "detector desconocido '{name}'; {advice}",
    "detector.known": "los paquetes instalados añaden: {names}",
    "detector.none": "ningún paquete instalado añade uno; quita 'detector' y decide 'vision'",
    "what.gate": "el 'gate' de una misión",
    "gate.size": "{key} de 'gate' es '{text}'; escribe metros, de {low:g} a {high:g}",
    "gate.opening": "bar_m {bar:g} de 'gate' no deja abertura; hazlo más fino o agranda el marco",
    "vision.needed": (
        "'{name}' necesita el mapa de marcos; añade la línea 'vision: frames' al principio de {file}"
    ),
    "when": "when '{when}': {reason}",
    "action": "'{action}': {reason}",
    # Expressions.
    "expression.call": (
        "aquí no se puede llamar a funciones; nombra un valor del piloto, o da un valor a goal_m y lee "
        "distance_to_goal_m"
    ),
    "expression.subscript": "[...] no es posible; nombra la parte, como imu.x",
    "expression.list": "[...] no es posible; escribe un lugar entre paréntesis: (x, y, z)",
    "expression.power": "** no es posible; escribe un producto",
    "expression.modulo": "% no es posible aquí",
    "expression.bit_and": "escribe 'and' en lugar de '&'",
    "expression.bit_or": "escribe 'or' en lugar de '|'",
    "expression.invert": "escribe 'not' en lugar de '~'",
    "expression.is": "escribe '==' en lugar de 'is'",
    "expression.is_not": "escribe '!=' en lugar de 'is not'",
    "expression.in": "'in' no es posible; compara con cada uno: colour == 'red' or colour == 'blue'",
    "expression.not_in": (
        "'not in' no es posible; compara con cada uno: colour != 'red' and colour != 'blue'"
    ),
    "expression.if": "'if' no es posible aquí; escribe una transición para cada caso",
    "expression.walrus": ":= no es posible; da el valor debajo de 'enter' o 'during'",
    "expression.kind": "{kind} no es posible aquí",
    "expression.constant": "{value!r} no es posible aquí",
    "expression.parentheses": "escríbelo sin paréntesis: {name}",
    "expression.after_name": "'.{name}' debe seguir a un nombre",
    "expression.empty": "aquí no hay nada escrito; escribe una expresión (lo que sigue a # no se lee)",
    "expression.long": "tiene más de {limit} caracteres; divídela",
    "expression.deep": "tiene demasiados niveles; escríbela más sencilla",
    "expression.too_deep": "no se entiende: tiene demasiados niveles",
    "expression.open_text": "aquí empieza un texto que no se cierra; escribe {sign} después",
    "expression.no_closing": "falta un ')'",
    "expression.no_opening": "falta un '('",
    "expression.not_understood": ("no se entiende desde '{rest}'; escribe una comparación como imu.z > 1"),
    "expression.and": "escribe 'and' en lugar de '{sign}'",
    "expression.or": "escribe 'or' en lugar de '{sign}'",
    "expression.not": "escribe 'not' en lugar de '{sign}'",
    "expression.unequal": "escribe '!=' en lugar de '{sign}'",
    "expression.at_most": "escribe '<=' en lugar de '{sign}'",
    "expression.at_least": "escribe '>=' en lugar de '{sign}'",
    "expression.equal": "escribe '==' en lugar de '{sign}'",
    "expression.assignment": "'=' da un valor; para comparar escribe '=='",
    "expression.change": "'{sign}' no es posible aquí; una condición solo compara",
    "expression.quotes": "escribe una comilla recta ' en lugar de {sign}",
    "expression.times": "escribe '*' en lugar de '{sign}'",
    "expression.minus": "escribe '-' en lugar de '{sign}'",
    "expression.divide": "escribe '/' en lugar de '{sign}'",
    "expression.percent": "'{sign}' no es posible; escribe 0.3 para un 30 %",
    "expression.small": "escribe '{lower}' en minúsculas",
    "expression.leave_out_if": "quita '{sign}'; 'when:' ya lo dice",
    "expression.leave_out_then": "quita '{sign}'; escribe el siguiente estado debajo, en 'to:'",
    "expression.unit": "escribe el número sin unidad: {number} en lugar de {sign}",
    "expression.value_again": "nombra el valor otra vez después de '{first}': a < 2 and a > 1",
    "expression.something_after": "falta algo después de '{sign}'",
    "expression.value_after": "falta un valor después de '{sign}'",
    # Kinds of values.
    "kind.condition": "verdadero o falso",
    "kind.number": "un número",
    "kind.text": "un texto",
    "kind.place": "un lugar (x, y, z)",
    "kind.parts": "varios valores",
    "kind.any": "cualquier cosa",
    "kind.text_alone": (
        "{shown} solo no es una condición; escribe la comparación completa: colour == {shown}"
    ),
    "kind.no_condition": "{shown} es {kind}, no una condición; {advice}",
    "kind.compare": "compáralo, como {example}",
    "kind.compare_number": "compara un número, como distance_to_goal_m < 0.2",
    "kind.several": "{shown} son varios valores; {advice}",
    "kind.part": "nombra una de sus partes, como {example}",
    "kind.too_fast": (
        "{name} = {value:g} es demasiado rápido; se vuela como mucho a {limit:g} {unit}: "
        "escribe un número de -{limit:g} a {limit:g}"
    ),
    "kind.not_assignable": "{name} es {wanted}, {shown} es {given}; escribe {example}",
    "kind.not_one_of": "{name} no puede ser {value!r}; es uno de {choices}",
    "kind.no_number": "{shown} no es un número; un lugar son tres números (x, y, z)",
    "kind.not_a_number": "{shown} es {kind}, no un número; {advice}",
    "kind.take_number": "usa un número",
    "kind.read_number": "lee distance_to_goal_m, o imu.x",
    "kind.no_quotes": "escribe un número sin comillas",
    "kind.never": "{shown} nunca es {value}; es uno de {choices}",
    "kind.never_equal": "{one} es {first}, {other} es {second}; nunca son iguales",
    "kind.comma": "{shown} son {count} valores; quita la coma",
    "kind.decimal_comma": "escribe los decimales con punto: {whole}.{part} en lugar de {whole},{part}",
    "kind.not_three": "{name} necesita tres números (x, y, z), aquí hay {count}",
    "kind.not_three_comma": "{name} necesita tres números (x, y, z), aquí hay {count}; {hint}",
    "kind.no_height": "{name} necesita tres números (x, y, z), aquí hay {count}; el tercero es la altura",
    # Names.
    "name.needs_values": "'{name}' necesita {needed}, pero una acción se llama sin valores",
    "name.value_as_action": "'{name}' es un valor, no una acción; escribe 'nombre = expresión'",
    "name.unknown_action": "acción desconocida '{name}'; {advice}",
    "name.action_as_value": "'{name}' es una acción, no un valor",
    "name.unknown": "nombre desconocido '{name}'; {advice}",
    "name.no_variable": "no hay ninguna variable '{name}'; {advice}",
    "name.declared": "declaradas debajo de 'variables': {names}",
    "name.no_part": "'{owner}' no tiene '{name}'; {advice}",
    "name.plain": "es un valor sin partes",
    "name.parts": "tiene {names}",
    "name.goal_whole": "goal_m se da entero: goal_m = (x, y, z)",
    "name.not_whole": "'{name}' no se puede dar entero; da {parts}",
    "name.read_only": (
        "'{name}' solo se puede leer; una misión da valores a cmd.vel_x y similares, goal_m, colour y "
        "memory.<variable>"
    ),
    "name.capital": "escribe {name}",
    "name.quotes": "escribe un texto entre comillas: '{name}'",
    "name.memory": "escribe memory.{name}",
    "name.known": "hay {names}",
    "name.known_pilot": "hay {names}; lo que añade un archivo de Python necesita --pilot FILE.py",
    "action.walrus": "para dar un valor escribe '=' en lugar de ':='",
    "action.equal": "'==' compara; para dar un valor escribe un solo '='",
    "action.colon_sign": "para dar un valor escribe '=' en lugar de ':'",
    "action.one_a_line": "una acción por línea; empieza cada línea con '- '",
    "action.in_full": "escríbelo completo: {name} = {name} {sign} {value}",
    "action.parentheses": "escríbelo sin paréntesis: {name}",
    "action.no_values": "'{name}' no lleva valores",
    "action.no_values_goal": "'{name}' no lleva valores; da un valor a goal_m en una línea antes",
}
