// What `/api/competition` answers, as framerunner/monitor/competition/views.py and stage.py have it.
import type { Contest } from "../lib/messages";

export type RunningTry = Contest.RunningView;
export type Team = { id: number; name: string; members: string; withdrawn: boolean };
export type Queued = { team: number; team_name: string };
export type Queue = { number: number; teams: Queued[] };
export type Call = Queued & { id: number; scenario: string; try: number | null; who: string; at: string };
export type LastCall = Queued & { id: number; tries: number[] };
export type DrawnRound = {
  round: number; scenarios: string[]; commands: string[]; pool: string[]; who: string; at: string;
};
export type Rule = {
  limit_s: number; missing_frame_s: number; scenarios: number; counting: "best" | "last"; who: string;
  at: string | null;
};
export type Result = {
  crossed: string[]; missing: string[]; contacts: number; penalty_s: number; try_time_s: number;
  total_s: number; completed: boolean; counted_s: number;
};
export type Try = {
  id: number; attempt: number; round: number; team: number | null; team_name: string; scenario: string;
  drone_id: number; frames: string[]; state: string; judged: boolean; barrier: string; verdict: string;
  reason: string; source: string; final: boolean; referee: Result; result: Result; corrected_by: string;
  judgements: number; started: string; ended: string | null;
};
export type Judgement = {
  number: number; kind: string; team_name: string; crossed: string[] | null; contacts: number | null;
  penalty_s: number | null; try_time_s: number | null; completed: boolean | null; remarks: string;
  who: string; at: string;
};
export type TryDetail = {
  try: Try; rival: { try: number; counted_s: number; contacts: number } | null; correction: Judgement | null;
  rule: Rule; history: Judgement[];
};
export type Cell = {
  scenario: string; counted_s: number; state: string; try: number | null; missing: number; tries: number;
};
export type Row = {
  rank: number | null; team: number; name: string; total_s: number; contacts: number; flown: number;
  cells: Cell[];
};
export type RankingOfRound = { round: number; scenarios: string[]; rows: Row[] };
export type Board = {
  version: number; round: number; rule: Rule; teams: Team[]; called: Call | null; last_call: LastCall | null;
  queue: Queue; draws: DrawnRound[]; tries: Try[]; rankings: RankingOfRound[];
};
export type State = { board: Board; running: RunningTry[]; problem: string; scenarios: string[] };
export type RankingState = {
  version: number; ranking: RankingOfRound; rounds: number[]; rule: Rule; called: Call | null; queue: Queue;
  running: RunningTry[]; problem: string;
};
export type FlownTry = {
  id: number; drone_id: number; team_name: string; scenario: string; frames: string[]; crossed: string[];
  splits: Record<string, number>; try_time_s: number; penalty_s: number; total_s: number; completed: boolean;
  verdict: string;
};
export type Stage = {
  running: RunningTry[]; called: Call | null; queue: Queue; last: FlownTry | null;
  interrupted: FlownTry | null; last_against: FlownTry | null; best: FlownTry[]; ranking: RankingOfRound;
  complete: boolean;
};
