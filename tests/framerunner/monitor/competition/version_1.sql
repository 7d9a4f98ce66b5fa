-- Tables of version 1 as its framerunner wrote them.
BEGIN TRANSACTION;
CREATE TABLE competition_draws (
	id INTEGER NOT NULL, 
	round INTEGER NOT NULL, 
	scenarios TEXT NOT NULL, 
	pool TEXT NOT NULL, 
	who VARCHAR(100) NOT NULL, 
	at DATETIME NOT NULL, 
	PRIMARY KEY (id)
);
INSERT INTO "competition_draws" VALUES(1,1,'case-1 red green blue
case-2 red green blue
case-3 red green blue','case-1
case-2
case-3
case-4','Ada','2030-05-17 12:00:00.000000');
CREATE TABLE competition_judgements (
	id INTEGER NOT NULL, 
	try_id INTEGER NOT NULL, 
	number INTEGER NOT NULL, 
	kind VARCHAR(20) NOT NULL, 
	team_id INTEGER, 
	crossed VARCHAR(80), 
	contacts INTEGER, 
	penalty_s DOUBLE, 
	try_time_s DOUBLE, 
	completed BOOLEAN, 
	remarks TEXT NOT NULL, 
	who VARCHAR(100) NOT NULL, 
	at DATETIME NOT NULL, 
	PRIMARY KEY (id), 
	UNIQUE (try_id, number), 
	FOREIGN KEY(try_id) REFERENCES competition_tries (id), 
	FOREIGN KEY(team_id) REFERENCES competition_teams (id)
);
INSERT INTO "competition_judgements" VALUES(1,1,1,'correction',NULL,NULL,NULL,30.0,NULL,NULL,'left bar','Ada','2030-05-17 12:00:00.000000');
CREATE TABLE competition_next (
	id INTEGER NOT NULL, 
	team_id INTEGER, 
	scenario VARCHAR(80) NOT NULL, 
	who VARCHAR(100) NOT NULL, 
	at DATETIME NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(team_id) REFERENCES competition_teams (id)
);
INSERT INTO "competition_next" VALUES(1,1,'case-1','Ada','2030-05-17 12:00:00.000000');
INSERT INTO "competition_next" VALUES(2,NULL,'','','2030-05-17 12:00:00.000000');
INSERT INTO "competition_next" VALUES(3,1,'','Ada','2030-05-17 12:00:00.000000');
INSERT INTO "competition_next" VALUES(4,NULL,'','Ada','2030-05-17 12:00:00.000000');
INSERT INTO "competition_next" VALUES(5,2,'case-2','Ada','2030-05-17 12:00:00.000000');
CREATE TABLE competition_schema (
	version INTEGER NOT NULL, 
	PRIMARY KEY (version)
);
INSERT INTO "competition_schema" VALUES(1);
CREATE TABLE competition_settings_changes (
	id INTEGER NOT NULL, 
	limit_s DOUBLE NOT NULL, 
	missing_frame_s DOUBLE NOT NULL, 
	scenarios INTEGER NOT NULL, 
	counting VARCHAR(10) NOT NULL, 
	who VARCHAR(100) NOT NULL, 
	at DATETIME NOT NULL, 
	PRIMARY KEY (id)
);
CREATE TABLE competition_team_changes (
	id INTEGER NOT NULL, 
	team_id INTEGER NOT NULL, 
	name VARCHAR(60) NOT NULL, 
	members TEXT NOT NULL, 
	withdrawn BOOLEAN NOT NULL, 
	who VARCHAR(100) NOT NULL, 
	at DATETIME NOT NULL, 
	PRIMARY KEY (id), 
	FOREIGN KEY(team_id) REFERENCES competition_teams (id)
);
INSERT INTO "competition_team_changes" VALUES(1,1,'Falken','Ann, Bo',0,'Ada','2030-05-17 12:00:00.000000');
INSERT INTO "competition_team_changes" VALUES(2,2,'Adler','',0,'Ada','2030-05-17 12:00:00.000000');
CREATE TABLE competition_teams (
	id INTEGER NOT NULL, 
	name VARCHAR(60) NOT NULL, 
	name_key VARCHAR(300) NOT NULL, 
	members TEXT NOT NULL, 
	withdrawn BOOLEAN NOT NULL, 
	PRIMARY KEY (id), 
	UNIQUE (name_key)
);
INSERT INTO "competition_teams" VALUES(1,'Falken','falken','Ann, Bo',0);
INSERT INTO "competition_teams" VALUES(2,'Adler','adler','',0);
CREATE TABLE competition_tries (
	id INTEGER NOT NULL, 
	"key" VARCHAR(200) NOT NULL, 
	drone_id INTEGER NOT NULL, 
	round INTEGER NOT NULL, 
	team_id INTEGER, 
	scenario VARCHAR(80) NOT NULL, 
	frames VARCHAR(80) NOT NULL, 
	state VARCHAR(20) NOT NULL, 
	report TEXT NOT NULL, 
	source VARCHAR(40) NOT NULL, 
	final BOOLEAN NOT NULL, 
	started DATETIME NOT NULL, 
	ended DATETIME, 
	PRIMARY KEY (id), 
	UNIQUE ("key"), 
	FOREIGN KEY(team_id) REFERENCES competition_teams (id)
);
INSERT INTO "competition_tries" VALUES(1,'k',1,1,1,'case-1','red green blue','ended','{"verdict": "clean", "reason": "clean after 40.0 s", "frames_crossed": ["red", "green", "blue"], "contacts": 0, "penalty_s": 0.0, "try_time_s": 40.0, "total_time_s": 40.0, "path_length_m": 20.0}','truth',0,'2030-05-17 12:00:00.000000','2030-05-17 12:00:00.000000');
CREATE INDEX ix_competition_draws_round ON competition_draws (round);
CREATE INDEX ix_competition_team_changes_team_id ON competition_team_changes (team_id);
CREATE INDEX ix_competition_tries_round ON competition_tries (round);
CREATE INDEX ix_competition_tries_team_id ON competition_tries (team_id);
CREATE INDEX ix_competition_tries_state ON competition_tries (state);
CREATE INDEX ix_competition_judgements_try_id ON competition_judgements (try_id);
COMMIT;
