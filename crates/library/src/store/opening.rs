//! Opening a database that may be anybody's, and making one.

use std::{
    fs::{self, OpenOptions},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use rusqlite::{Connection, ErrorCode, OpenFlags, TransactionBehavior};

use crate::LibraryError;

/// The version of the tables that this library writes and reads: SQLite's `user_version`.
pub const SCHEMA_VERSION: i64 = 5;

/// SQLite's `application_id`: "sgmk".
const APPLICATION: i64 = 0x7367_6d6b;

const SCHEMA: &str = include_str!("schema.sql");

/// How long one waits for another writer. An original takes some milliseconds to write.
const PATIENCE: Duration = Duration::from_secs(60);

/// Held while a file is made or opened: whoever closes a file takes away all locks that this process has on it, those of other connections among them.
static OPENING: Mutex<()> = Mutex::new(());

/// Opens a library that is there.
pub(super) fn open(path: &Path) -> Result<Connection, LibraryError> {
    if !path.exists() {
        return Err(LibraryError::Missing { path: path.into() });
    }
    let open = |flags| checked(connect(path, path, flags)?, path);
    open(OpenFlags::SQLITE_OPEN_READ_WRITE).or_else(|error| match &error {
        // Nobody can put SQLite's files beside it here: it is read as what stays as it is, unless somebody's log says that it does not.
        LibraryError::Database { source, .. } if is_of_writing(source) && !has_log(path) => {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
            checked(connect(path, &unchanging(path), flags)?, path)
        }
        // A medium that can't be written to.
        LibraryError::Database { .. } => open(OpenFlags::SQLITE_OPEN_READ_ONLY),
        _ => Err(error),
    })
}

/// The connection, if it is to a library.
fn checked(connection: Connection, path: &Path) -> Result<Connection, LibraryError> {
    match state(&connection, path)? {
        State::Ours => check_tables(&connection, path)?,
        State::Empty => {
            return Err(LibraryError::Foreign {
                path: path.into(),
                problem: "it is empty".into(),
            });
        }
    }
    Ok(connection)
}

/// Whether a file or its folder can't be written to.
fn is_of_writing(error: &rusqlite::Error) -> bool {
    matches!(
        error.sqlite_error_code(),
        Some(ErrorCode::ReadOnly | ErrorCode::CannotOpen)
    )
}

/// Whether a log of changes lies beside a library.
fn has_log(path: &Path) -> bool {
    let mut log = fs::canonicalize(path)
        .unwrap_or_else(|_| path.into())
        .into_os_string();
    log.push("-wal");
    Path::new(&log).exists()
}

/// The name by which SQLite reads a file without locks and without files beside it.
fn unchanging(path: &Path) -> PathBuf {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.into());
    let bytes = full.as_os_str().as_encoded_bytes();
    let mut name = String::from(if bytes.starts_with(b"/") {
        "file:"
    } else {
        "file:/"
    });
    for &byte in bytes {
        match byte {
            b'\\' if cfg!(windows) => name.push('/'),
            b'/' | b':' | b'.' | b'-' | b'_' => name.push(byte.into()),
            _ if byte.is_ascii_alphanumeric() => name.push(byte.into()),
            _ => name.push_str(&format!("%{byte:02X}")),
        }
    }
    name.push_str("?immutable=1");
    name.into()
}

/// Opens a library, or makes one where there is none.
pub(super) fn create(path: &Path) -> Result<Connection, LibraryError> {
    make_private(path);
    let mut connection = connect(path, path, OpenFlags::SQLITE_OPEN_READ_WRITE)?;
    // Nothing is written to a file before it is known to be ours, or empty.
    if let State::Empty = state(&connection, path)? {
        write_ahead(&connection, path)?;
        let mut made = || -> rusqlite::Result<()> {
            let transaction = connection.transaction_with_behavior(TransactionBehavior::Immediate)?;
            // Another writer may have been first.
            let tables: i64 =
                transaction.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0))?;
            if tables == 0 {
                transaction.execute_batch(SCHEMA)?;
                transaction.pragma_update(None, "application_id", APPLICATION)?;
                transaction.pragma_update(None, "user_version", SCHEMA_VERSION)?;
            }
            transaction.commit()
        };
        made().map_err(|error| of(path, error))?;
        state(&connection, path)?;
    }
    check_tables(&connection, path)?;
    Ok(connection)
}

/// Makes an empty file that its owner alone can read, if there is none: certificates will be in it. SQLite's files beside it take after it. Why it can't be made, SQLite says when it opens it.
fn make_private(path: &Path) {
    let mut new = OpenOptions::new();
    new.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut new, 0o600);
    let _alone = OPENING.lock().unwrap_or_else(PoisonError::into_inner);
    drop(new.open(path));
}

/// Connects to a library by a name of its file, with which SQLite is told how to read it.
fn connect(path: &Path, name: &Path, flags: OpenFlags) -> Result<Connection, LibraryError> {
    let set = || -> rusqlite::Result<Connection> {
        let connection = {
            let _alone = OPENING.lock().unwrap_or_else(PoisonError::into_inner);
            Connection::open_with_flags(name, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?
        };
        connection.busy_timeout(PATIENCE)?;
        // What a stranger's file would have functions do is not done, and its pages are looked at before they are believed.
        connection.pragma_update(None, "trusted_schema", false)?;
        connection.pragma_update(None, "cell_size_check", true)?;
        connection.pragma_update(None, "foreign_keys", true)?;
        // With a log ahead of the file, a kill at any moment leaves the last whole transaction; so does a loss of power, at worst the one before.
        connection.pragma_update(None, "synchronous", "NORMAL")?;
        Ok(connection)
    };
    set().map_err(|error| of(path, error))
}

/// Readers go on while somebody writes. Two who ask for it at once may be refused without having waited.
fn write_ahead(connection: &Connection, path: &Path) -> Result<(), LibraryError> {
    let begun = Instant::now();
    loop {
        let set = connection.query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()));
        match set.map_err(|error| of(path, error)) {
            Err(LibraryError::Busy { .. }) if begun.elapsed() < PATIENCE => {
                thread::sleep(Duration::from_millis(20));
            }
            other => return other,
        }
    }
}

/// What a file is.
enum State {
    Ours,
    Empty,
}

fn state(connection: &Connection, path: &Path) -> Result<State, LibraryError> {
    // One transaction: between two, another writer may make the library.
    let facts = || -> rusqlite::Result<(i64, i64, i64)> {
        let transaction = connection.unchecked_transaction()?;
        let number = |question: &str| transaction.query_row(question, [], |row| row.get(0));
        let tables = number("SELECT count(*) FROM sqlite_schema")?;
        Ok((
            number("PRAGMA application_id")?,
            number("PRAGMA user_version")?,
            tables,
        ))
    };
    let (application, version, tables) = facts().map_err(|error| of(path, error))?;
    match (application, version, tables) {
        (APPLICATION, SCHEMA_VERSION, _) => Ok(State::Ours),
        (APPLICATION, found, _) if found > SCHEMA_VERSION => Err(LibraryError::Newer {
            path: path.into(),
            found,
            expected: SCHEMA_VERSION,
        }),
        (APPLICATION, found, _) => Err(LibraryError::Older {
            path: path.into(),
            found,
            expected: SCHEMA_VERSION,
        }),
        (0, 0, 0) => Ok(State::Empty),
        _ => Err(LibraryError::Foreign {
            path: path.into(),
            problem: "a database of another program".into(),
        }),
    }
}

/// The tables are word for word those that this library makes: no views, no triggers, nothing that runs when it is asked.
fn check_tables(connection: &Connection, path: &Path) -> Result<(), LibraryError> {
    let words = |connection: &Connection| -> rusqlite::Result<Vec<(String, String, Option<String>)>> {
        let mut statement = connection.prepare("SELECT type, name, sql FROM sqlite_schema ORDER BY name")?;
        let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        rows.collect()
    };
    let expected = Connection::open_in_memory().and_then(|model| {
        model.execute_batch(SCHEMA)?;
        words(&model)
    });
    let expected = expected.map_err(|error| of(path, error))?;
    let found = words(connection).map_err(|error| of(path, error))?;
    match found == expected {
        true => Ok(()),
        false => Err(LibraryError::Foreign {
            path: path.into(),
            problem: "its tables are not those of a library".into(),
        }),
    }
}

/// What SQLite says, with the file.
pub(super) fn of(path: &Path, error: rusqlite::Error) -> LibraryError {
    let path = path.to_path_buf();
    let damaged = |problem: String| LibraryError::Damaged {
        path: path.clone(),
        problem,
    };
    match (&error, error.sqlite_error_code()) {
        (_, Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked)) => LibraryError::Busy { path },
        (_, Some(ErrorCode::NotADatabase)) => LibraryError::Foreign {
            path,
            problem: "it is no SQLite database".into(),
        },
        (_, Some(ErrorCode::DatabaseCorrupt | ErrorCode::TooBig)) => damaged(error.to_string()),
        (
            rusqlite::Error::FromSqlConversionFailure(..)
            | rusqlite::Error::IntegralValueOutOfRange(..)
            | rusqlite::Error::InvalidColumnType(..)
            | rusqlite::Error::Utf8Error(..),
            _,
        ) => damaged(error.to_string()),
        _ => LibraryError::Database { path, source: error },
    }
}
