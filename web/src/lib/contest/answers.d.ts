// What `/api/competition` answers, as framerunner/monitor/competition/views.py and stage.py have it.
import type { Contest } from "../messages";

export type RunningTry = Contest.RunningView;
export type Queued = { team: number; team_name: string };
export type Queue = { number: number; teams: Queued[] };
export type Call = Queued & { id: number; scenario: string; try: number | null; who: string; at: string };
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
export type Cell = {
  scenario: string; counted_s: number; state: string; try: number | null; missing: number; tries: number;
};
export type Row = {
  rank: number | null; team: number; name: string; total_s: number; contacts: number; flown: number;
  cells: Cell[];
};
export type RankingOfRound = { round: number; scenarios: string[]; rows: Row[] };
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
