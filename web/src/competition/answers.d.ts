// What `/api/competition` answers, as framerunner/monitor/competition/views.py and stage.py have it.
import type { Call, Queue, Queued, RankingOfRound, RunningTry, Try } from "../lib/contest/answers";

export type {
  Call, Cell, FlownTry, Queue, Queued, RankingOfRound, Result, Row, RunningTry, Stage, Try,
} from "../lib/contest/answers";

export type Team = { id: number; name: string; members: string; withdrawn: boolean };
export type LastCall = Queued & { id: number; tries: number[] };
export type DrawnRound = {
  round: number; scenarios: string[]; commands: string[]; pool: string[]; who: string; at: string;
};
export type Rule = {
  limit_s: number; missing_frame_s: number; scenarios: number; counting: "best" | "last"; who: string;
  at: string | null;
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
export type Board = {
  version: number; round: number; rule: Rule; teams: Team[]; called: Call | null; last_call: LastCall | null;
  queue: Queue; draws: DrawnRound[]; tries: Try[]; rankings: RankingOfRound[];
};
export type State = { board: Board; running: RunningTry[]; problem: string; scenarios: string[] };
export type RankingState = {
  version: number; ranking: RankingOfRound; rounds: number[]; rule: Rule; called: Call | null; queue: Queue;
  running: RunningTry[]; problem: string;
};
