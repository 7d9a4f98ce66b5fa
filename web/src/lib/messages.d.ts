// Made by web/page_types.py from the models of the messages; `make page-types` makes it anew.

export namespace Contest {
  type ChangedMessage = { kind: "changed"; version: number; problem: string };
  type RunningMessage = { kind: "running"; tries: (RunningView)[] };
  type RunningView = { id: number; team: number | null; team_name: string; scenario: string; barrier: string; drone_id: number; frames: (string)[]; crossed: (string)[]; contacts: number; penalty_s: number; try_time_s: number };
  type ToPage = ChangedMessage | RunningMessage;
}

export namespace Documents {
  type EditMessage = { number: number; kind: "edit"; edit: Record<string, any> };
  type LayoutMessage = { number: number; kind: "layout"; places: Record<string, StateBox | null>; settled?: boolean };
  type SaveMessage = { number: number; kind: "save"; force?: boolean };
  type StateBox = { x: number; y: number; width?: number | null; height?: number | null };
  type StepMessage = { number: number; kind: "undo" | "redo" };
  type TypeMessage = { number: number; kind: "type"; revision: number; changes: (TypedChange)[] };
  type TypedChange = { start: number; removed: number; inserted: string };
  type FromPage = EditMessage | TypeMessage | StepMessage | SaveMessage | LayoutMessage;
  type Catalogue = { values: (ValueEntry)[]; primitives: (PrimitiveEntry)[]; operators: (string)[] };
  type ChangedMessage = { others?: number; warning?: string; answers?: number; refused?: string; code?: string; saved: boolean; can_undo: boolean; can_redo: boolean; name: string; revision: number; session: string; restored: boolean; problem: string; diagram: Diagram; mission: Record<string, string>; variables: Record<string, string>; templates: (string)[]; findings: (Finding)[]; spanish?: (string)[]; layout: Record<string, Place>; catalogue?: Catalogue; answered?: number; kind: "changed"; changes: (TypedChange)[]; text?: string };
  type Diagram = { name: string; initial: string; nodes: (Node)[]; edges: (Edge)[]; settings?: Record<string, string>; variables?: Record<string, string>; templates?: Record<string, (string)[]>; readable: boolean };
  type DocumentMessage = { others?: number; warning?: string; answers?: number; refused?: string; code?: string; saved: boolean; can_undo: boolean; can_redo: boolean; name: string; revision: number; session: string; restored: boolean; problem: string; diagram: Diagram; mission: Record<string, string>; variables: Record<string, string>; templates: (string)[]; findings: (Finding)[]; spanish?: (string)[]; layout: Record<string, Place>; catalogue?: Catalogue; answered?: number; kind: "document"; text: string; changes?: (TypedChange)[] };
  type Edge = { id: string; source: string; target: string; missing: boolean; event: "tick" | "done" | "resume"; order: number; when: string; actions: (string)[]; source_state: string; source_index: number; span: Span | null; when_span: Span | null; to_span: Span | null };
  type Finding = { severity: "error" | "warning" | "advice"; code: string; message: string; file: string; line: number; column: number; start: number; end: number; state: string; event: "tick" | "done" | "resume" | null; index: number | null; section: "enter" | "during" | "exit" | string; nodes: (string)[] };
  type Node = { id: string; name: string; parent: string; initial: string; final: boolean; finish: boolean; enter: (string)[]; during: (string)[]; exit: (string)[]; parameters: ([string, string])[]; template: string; source: string; span: Span | null; name_span: Span | null };
  type Place = { x: number; y: number };
  type PrimitiveEntry = { name: string; text: string; help: string; needs_map: boolean; own: boolean };
  type Span = { start: number; end: number };
  type StatusMessage = { others?: number; warning?: string; answers?: number; refused?: string; code?: string; kind: "status"; saved?: boolean; can_undo?: boolean; can_redo?: boolean; layout?: Record<string, Place> };
  type ValueEntry = { name: string; type: string; text: string; unit: string; low: number | null; high: number | null; choices: (any)[]; assignable: boolean; needs_map: boolean; own: boolean };
  type ToPage = DocumentMessage | ChangedMessage | StatusMessage;
}

export namespace Flights {
  type BreakOn = { tag?: number; language?: "en" | "es"; run: string; kind: "break_on"; states?: (string)[] };
  type Cancel = { tag?: number; language?: "en" | "es"; kind: "cancel"; batch: string };
  type Change = { tag?: number; language?: "en" | "es"; run: string; kind: "change"; text: string };
  type GoOn = { tag?: number; language?: "en" | "es"; run: string; kind: "go_on" };
  type Pause = { tag?: number; language?: "en" | "es"; run: string; kind: "pause" };
  type Speed = { tag?: number; language?: "en" | "es"; run: string; kind: "speed"; speed: number | null };
  type Start = { tag?: number; language?: "en" | "es"; kind: "start"; text: string; scenario?: string; seed?: number; speed?: number | null; paused?: boolean; break_on?: (string)[] };
  type StartBatch = { tag?: number; language?: "en" | "es"; kind: "start_batch"; text: string; level?: string | null; count?: number; first_seed?: number; scenarios?: (string)[] };
  type StartLive = { tag?: number; language?: "en" | "es"; kind: "start_live"; text: string; scenario?: string; speed?: number };
  type Step = { tag?: number; language?: "en" | "es"; run: string; kind: "step"; ticks?: number };
  type Stop = { tag?: number; language?: "en" | "es"; run: string; kind: "stop" };
  type StopLive = { tag?: number; language?: "en" | "es"; kind: "stop_live" };
  type Watch = { tag?: number; language?: "en" | "es"; run: string; kind: "watch" };
  type FromPage = Start | Pause | GoOn | Step | Speed | BreakOn | Change | Stop | Watch | StartBatch | Cancel | StartLive | StopLive;
  type BatchEnded = { kind: "batch_ended"; batch: string; flown: number; completed: number; count: number; text: string; order: (string)[] };
  type BatchStarted = { kind: "batch_started"; tag: number; batch: string; count: number };
  type Changed = { kind: "changed"; run: string; tag: number; ids: Record<string, string> };
  type Contact = { name: string; time_s: number };
  type Done = { kind: "done"; tag: number };
  type Ended = { kind: "ended"; run: string; text: string; lost_in: string; result: Record<string, any> | null; counts: Record<string, number>; spans: (StateSpan)[] };
  type Flight = { kind: "flight"; batch: string; scenario: string; seed: number; verdict: string; completed: boolean; reason: string; cause: string; lost_in: string; rank: number; total_time_s: number | null; frames_crossed: (string)[]; counts: Record<string, number>; track: FlownTrack; layout: Record<string, any>; result: Record<string, any>; replay: string };
  type FlownTrack = { time_s: (number | null)[]; x: (number | null)[]; y: (number | null)[]; z: (number | null)[]; state: (number)[]; states: (string)[] };
  type GuardNow = { id: string; to: string; when: string; holds: boolean | null };
  type Live = { kind: "live"; state: "starting" | "flying" | "ended" | "stopped"; scenario: string; speed: number; text: string };
  type Now = { kind: "now"; run: string; full: boolean; time_s: number; began_s: number | null; state: string; active: (string)[]; seconds_in_state: number; paused: boolean; stopped_in: string; speed: number | null; guards: (GuardNow)[]; values: (ValueNow)[]; taken: (Taken)[]; counts: Record<string, number>; spans: (StateSpan)[]; contacts: (Contact)[]; pose: (number | null)[]; command: (number | null)[]; trail: ((number | null)[])[] };
  type Refused = { kind: "refused"; tag: number; text: string; lines: (string)[]; run: string };
  type Started = { kind: "started"; tag: number; run: string; layout: Record<string, any> };
  type StateSpan = { state: string; from_s: number; to_s: number };
  type Taken = { ids: (string)[]; source: string; target: string; when: string; values: ([string, number | boolean | string | null])[]; time_s: number; seconds: number };
  type ValueNow = { name: string; value: number | boolean | string | null; unit: string };
  type Waiting = { kind: "waiting"; tag: number; run: string; place: number; seconds: number | null };
  type ToPage = Started | Now | Changed | Refused | Waiting | Done | Ended | BatchStarted | Flight | BatchEnded | Live;
}

export namespace Live {
  type ActiveFault = { fault: string; active: boolean };
  type Chart = { kind: "chart"; id: number; name: string; mermaid: string; states: (string)[]; source: string };
  type Detections = { kind: "detections"; id: number; t: number | null; width: number; height: number; boxes: Record<string, (number | null)[] | null> };
  type DronePose = { id: number; t: number; p: [number, number, number]; truth: [number, number, number] | null; q: [number, number, number, number]; v: [number, number, number] | null; r: number | null; c: (number | null)[] | null; on: boolean; s: number; fresh: boolean };
  type DroneStatus = { id: number; name: string; mode: string; armed: boolean; landed: boolean | null; battery_percent: number | null; voltage_v: number | null; link: LinkStatus; mission: MissionStatus | null; pilot: string; figures: Figures | null; video: boolean; over: boolean };
  type EstimatedPlace = { p: [number, number, number]; yaw: number; std: [number, number, number]; yaw_std: number };
  type Figures = { try_time_s: number | null; penalty_s: number | null; total_time_s: number | null; limit_s: number | null; time_over: boolean; crossed: (string)[]; crossing_times_s: (number | null)[]; next_colour: string | null; contacts: number | null; inside: boolean; motors_on: boolean; over: boolean; verdict: string; reason: string; source: string; final: boolean; faults?: (ActiveFault)[]; failsafe?: string };
  type FlightHistory = { kind: "history"; id: number; poses: ((number | null)[])[] };
  type GuardState = { id: string; holds: boolean | null };
  type Guards = { kind: "guards"; id: number; time_s: number; counts: Record<string, number>; guards: (GuardState)[]; values: (ValueNow)[] };
  type LinkStatus = { state: "live" | "stale" | "lost"; age_s: number; loss_percent: number | null; rate_hz: number | null };
  type Map = { kind: "map"; id: number; t: number; goal: string; frames: (MappedFrame)[]; path: ([number, number, number])[]; place: EstimatedPlace | null };
  type MappedFrame = { colour: string; p: [number, number, number]; yaw: number; std: [number, number, number] | null; yaw_std: number | null; certain: boolean; ambiguous: boolean; views: number; size: [number, number] | null };
  type MissionStatus = { name: string; state: string; seconds: number; transitions: number; paused: boolean; flying: boolean; finished: boolean; alive: boolean };
  type Notice = { kind: "notice"; id: number | null; level: "info" | "warning" | "error"; text: string };
  type Poses = { kind: "pose"; drones: (DronePose)[] };
  type Status = { kind: "status"; drones: (DroneStatus)[] };
  type Text = { kind: "text"; id: number; time_s: number; severity: number; text: string; from: "drone" | "mission" };
  type Transition = { time_s: number; from: string; to: string; when: string; values: ([string, number | boolean | string | null])[]; seconds: number; ids: (string)[] };
  type Transitions = { kind: "transitions"; id: number; list: (Transition)[] };
  type ValueNow = { name: string; value: number | boolean | string | null; unit: string };
  type World = { kind: "world"; scenario: Record<string, any> | null; lift_m: number; source: string };
  type ToPage = World | Poses | Status | FlightHistory | Detections | Map | Chart | Transitions | Guards | Text | Notice;
}

export namespace ManualControl {
  type Order = { kind?: "do"; id: number; what: "take" | "give" | "arm" | "disarm" | "take_off" | "land" | "hold" | "stop_motors"; confirmed?: boolean };
  type SticksMessage = { kind: "sticks"; forward: number; right: number; up: number; yaw: number };
  type FromPage = SticksMessage | Order;
  type ControlMessage = { kind: "control"; id: number; holder: string; yours: boolean; flying: boolean };
  type Reply = { kind: "reply"; what: string; ok: boolean; text: string };
  type ToPage = Reply | ControlMessage;
}

export namespace Operator {
  type FromPage = { kind: "here" | "go" | "let_go" | "stop" | "stop_motors"; beat?: number; flight?: string };
  type AnswerMessage = { kind: "answer"; page: number; text: string };
  type BeatMessage = { kind: "beat"; flight: string; beat: number; phase: string; asks: boolean; stops: number; terminal: boolean; words: string; pages: (PageState)[] };
  type CardSection = { title: string; rows: (Row)[] };
  type EndMessage = { kind: "end"; flight: string; words: string; lost: boolean };
  type FlightMessage = { kind: "flight"; flight: string; title: string; sections: (CardSection)[]; failed: (string)[] };
  type NoFlightMessage = { kind: "none" };
  type PageState = { page: number; name: string; alive: boolean; delay_ms: number | null };
  type Row = { cells: (string)[] };
  type YouMessage = { kind: "you"; page: number };
  type ToPage = YouMessage | NoFlightMessage | FlightMessage | BeatMessage | AnswerMessage | EndMessage;
}
