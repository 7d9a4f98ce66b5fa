"""How much processor time the editor's core takes for a large mission: text to diagram, the checker, an edit.

python -m benchmarks.authoring [--states 200] [--transitions 2] [--repeats 20]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from statistics import median
from time import process_time

from offboard.authoring import Document, apply, as_json, catalogue, check_document, diagram, parse_edit


def large_mission(states: int, transitions: int) -> str:
    """A mission with superstates of ten states each, each with comments, actions and transitions."""
    lines = ["name: large", "initial: group_0", "variables:", "  count: 0", "states:"]
    groups = max(1, states // 11)
    for group in range(groups):
        lines += [f"  # the group {group}", f"  group_{group}:", "    initial: state_0", "    states:"]
        for number in range(10):
            lines += [
                f"      state_{number}: # number {number}",
                "        enter:",
                "          - hover",
                "          - cmd.vel_x = (frame.d - 0.4) / 2",
                "        during:",
                "          - look_to_frame",
                "        transitions:",
            ]
            for order in range(transitions):
                target = f"state_{(number + 1) % 10}" if order else "end"
                guard = f"seconds_in_state > {number + 0.5}" if order else f"frame.d < 0.{group + 1:02d}"
                lines += [f"          - when: {guard}", f"            to: {target}"]
        lines += ["      end:", "        final: true", f"    then: group_{group + 1}"]
    lines += [f"  group_{groups}:", "    enter:", "      - land", "    final: true"]
    return "\n".join(lines) + "\n"


def milliseconds(what: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Median and longest processor time of a call."""
    times = []
    for _ in range(repeats):
        started = process_time()
        what()
        times.append(1e3 * (process_time() - started))
    return median(times), max(times)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.authoring", description=__doc__)
    parser.add_argument("--states", type=int, default=200)
    parser.add_argument("--transitions", type=int, default=2, help="of each state")
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    text = large_mission(options.states, options.transitions)
    drawn = diagram(Document.from_text(text))
    print(f"{len(drawn.nodes)} states, {len(drawn.edges)} transitions, {len(text)} characters")
    opened = Document.from_text(text)
    guard = parse_edit(
        {"kind": "set_guard", "transition": {"state": "group_3.state_3", "index": 1}, "when": "frame_seen"}
    )
    rename = parse_edit({"kind": "rename_state", "state": "group_3.state_3", "name": "other"})
    parts: dict[str, Callable[[], object]] = {
        "text to diagram": lambda: diagram(Document.from_text(text)),
        "text to diagram, as JSON": lambda: as_json(diagram(Document.from_text(text))),
        "check": lambda: check_document(Document.from_text(text)),
        "edit a guard": lambda: apply(opened, guard),
        "rename a state": lambda: apply(opened, rename),
        "catalogue": catalogue,
    }
    for name, call in parts.items():
        middle, longest = milliseconds(call, options.repeats)
        print(f"{name:26s} median {middle:6.1f} ms, longest {longest:6.1f} ms")


if __name__ == "__main__":
    main()
