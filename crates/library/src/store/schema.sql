CREATE TABLE original (
    id INTEGER PRIMARY KEY,
    digest TEXT NOT NULL UNIQUE,
    name TEXT NOT NULL,
    vertices INTEGER NOT NULL,
    triangles INTEGER NOT NULL
) STRICT;
CREATE TABLE descriptor (
    original INTEGER PRIMARY KEY REFERENCES original (id) ON DELETE CASCADE,
    whole BLOB NOT NULL,
    smooth BLOB NOT NULL,
    local BLOB NOT NULL,
    words BLOB NOT NULL,
    stars BLOB NOT NULL
) STRICT;
CREATE TABLE surface (
    original INTEGER PRIMARY KEY REFERENCES original (id) ON DELETE CASCADE,
    bytes BLOB NOT NULL
) STRICT;
CREATE TABLE geometry (
    original INTEGER PRIMARY KEY REFERENCES original (id) ON DELETE CASCADE,
    packed BLOB NOT NULL
) STRICT;
CREATE TABLE certificate (
    sha256 BLOB PRIMARY KEY,
    original TEXT NOT NULL,
    recipient TEXT NOT NULL,
    message TEXT NOT NULL,
    key TEXT NOT NULL,
    text TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE INDEX certificate_of ON certificate (original);
CREATE TABLE file (
    path TEXT PRIMARY KEY,
    size INTEGER NOT NULL,
    modified INTEGER NOT NULL,
    original INTEGER REFERENCES original (id) ON DELETE CASCADE,
    certificate BLOB REFERENCES certificate (sha256) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;
CREATE INDEX file_of ON file (original);
