//! The database.

mod opening;
mod records;

use std::path::{Path, PathBuf};

use job::Job;
use mesh::TriMesh;
use rusqlite::{Connection, OptionalExtension, Row, Transaction, TransactionBehavior, params, types::Type};
use sha2::{Digest, Sha256};
use sigmark::GeometryDigest;

use crate::{
    LibraryError,
    descriptor::{LOCAL_LENGTH, STAR, STARS, SURFACE_LENGTH, Star, Summary, WORDS},
    geometry::unpack_geometry,
};
pub use opening::SCHEMA_VERSION;
pub use records::{AddedAs, CertificateRecord, Entry, FileRecord, OriginalId, OriginalRecord};

/// Originals and certificates in one file.
///
/// Every call that writes is one transaction: who is killed leaves it done or not begun, and who comes second waits.
#[derive(Debug)]
pub struct Library {
    connection: Connection,
    path: PathBuf,
}

impl Library {
    /// Opens a library that is there.
    ///
    /// # Errors
    /// [`LibraryError::Missing`], [`LibraryError::Foreign`], [`LibraryError::Newer`], [`LibraryError::Older`], [`LibraryError::Damaged`].
    pub fn open(path: &Path) -> Result<Self, LibraryError> {
        Ok(Self {
            connection: opening::open(path)?,
            path: path.into(),
        })
    }

    /// Opens a library, or makes an empty one where there is none.
    ///
    /// # Errors
    /// As [`open`](Self::open), but for the first.
    pub fn create(path: &Path) -> Result<Self, LibraryError> {
        Ok(Self {
            connection: opening::create(path)?,
            path: path.into(),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds an original with its file. Of one whose geometry is there already, the file is noted, and the geometry kept if it was not.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn add(&mut self, entry: &Entry) -> Result<AddedAs, LibraryError> {
        self.write(|transaction| {
            let digest = entry.digest.to_string();
            let known = "SELECT id FROM original WHERE digest = ?1";
            let known: Option<i64> = transaction
                .query_row(known, [&digest], |row| row.get(0))
                .optional()?;
            let id = match known {
                Some(id) => id,
                None => insert(transaction, &digest, entry)?,
            };
            if let Some(packed) = &entry.geometry {
                let keep = "INSERT INTO geometry VALUES (?1, ?2) ON CONFLICT DO NOTHING";
                transaction.execute(keep, params![id, packed])?;
            }
            if let Some(file) = &entry.file {
                note(transaction, file, Some(id), None)?;
            }
            let id = OriginalId(id);
            Ok(match known {
                Some(_) => AddedAs::Known(id),
                None => AddedAs::New(id),
            })
        })
    }

    /// Adds a certificate, which its caller has checked, and the file in which it lies. Tells whether it is new.
    ///
    /// # Errors
    /// When the file can't be written.
    pub fn add_certificate(
        &mut self,
        certificate: &CertificateRecord,
        file: Option<&FileRecord>,
    ) -> Result<bool, LibraryError> {
        self.write(|transaction| {
            let sha256 = Sha256::digest(certificate.text.as_bytes()).to_vec();
            let added = transaction.execute(
                "INSERT INTO certificate VALUES (?1, ?2, ?3, ?4, ?5, ?6) ON CONFLICT DO NOTHING",
                params![
                    sha256,
                    certificate.original.to_string(),
                    certificate.recipient,
                    certificate.message,
                    certificate.key,
                    certificate.text
                ],
            )?;
            if let Some(file) = file {
                note(transaction, file, None, Some(&sha256))?;
            }
            Ok(added > 0)
        })
    }

    /// Whether a file was read when it was as it is now.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn knows(&self, file: &FileRecord) -> Result<bool, LibraryError> {
        self.is_noted("file", file)
    }

    /// Whether a file was read when it was as it is now, and the geometry that was in it is here.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn keeps(&self, file: &FileRecord) -> Result<bool, LibraryError> {
        self.is_noted("file JOIN geometry USING (original)", file)
    }

    /// Whether a file is among these rows as it is now.
    fn is_noted(&self, rows: &str, file: &FileRecord) -> Result<bool, LibraryError> {
        let question = format!("SELECT count(*) FROM {rows} WHERE path = ?1 AND size = ?2 AND modified = ?3");
        let given = params![file.path, file.size as i64, file.modified];
        let count = self
            .connection
            .query_row(&question, given, |row| row.get::<_, i64>(0));
        Ok(self.read(count)? > 0)
    }

    /// Whether a certificate names this geometry as its original.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn names(&self, digest: &GeometryDigest) -> Result<bool, LibraryError> {
        let question = "SELECT count(*) FROM certificate WHERE original = ?1";
        let count = self
            .connection
            .query_row(question, [digest.to_string()], |row| row.get::<_, i64>(0));
        Ok(self.read(count)? > 0)
    }

    /// How many originals there are.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn count(&self) -> Result<usize, LibraryError> {
        let count = self
            .connection
            .query_row("SELECT count(*) FROM original", [], |row| row.get::<_, i64>(0));
        Ok(self.read(count)?.max(0) as usize)
    }

    /// All originals, in the order in which they came.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn originals(&self) -> Result<Vec<OriginalRecord>, LibraryError> {
        self.records("ORDER BY id", [])
    }

    /// An original.
    ///
    /// # Errors
    /// [`LibraryError::NoOriginal`].
    pub fn original(&self, id: OriginalId) -> Result<OriginalRecord, LibraryError> {
        let found = self.records("WHERE id = ?1", [id.0])?.pop();
        found.ok_or(LibraryError::NoOriginal { number: id.0 })
    }

    /// The geometry of an original, or none where it was not kept.
    ///
    /// # Errors
    /// [`LibraryError::Damaged`], where it is not what the digest says.
    pub fn geometry(&self, original: &OriginalRecord) -> Result<Option<TriMesh>, LibraryError> {
        let question = "SELECT packed FROM geometry WHERE original = ?1";
        let packed = self
            .connection
            .query_row(question, [original.id.0], |row| row.get::<_, Vec<u8>>(0));
        let Some(packed) = self.read(packed.optional())? else {
            return Ok(None);
        };
        let of_it = |problem: String| self.damaged(format!("the geometry of {}: {problem}", original.name));
        let mesh = unpack_geometry(&packed).map_err(|error| of_it(error.to_string()))?;
        match GeometryDigest::of(&mesh) == original.digest {
            true => Ok(Some(mesh)),
            false => Err(of_it("it has another digest".into())),
        }
    }

    /// The certificates that name an original, by recipients.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn certificates(&self, original: &GeometryDigest) -> Result<Vec<CertificateRecord>, LibraryError> {
        let given = [original.to_string()];
        let rows = || -> rusqlite::Result<Vec<CertificateRecord>> {
            let mut statement = self.connection.prepare(
                "SELECT recipient, message, key, text FROM certificate WHERE original = ?1 ORDER BY recipient, sha256",
            )?;
            let rows = statement.query_map(given, |row| {
                Ok(CertificateRecord {
                    original: *original,
                    recipient: row.get(0)?,
                    message: row.get(1)?,
                    key: row.get(2)?,
                    text: row.get(3)?,
                })
            })?;
            rows.collect()
        };
        self.read(rows())
    }

    /// Certificates whose originals are not here.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn waiting(&self) -> Result<usize, LibraryError> {
        let question = "SELECT count(*) FROM certificate WHERE original NOT IN (SELECT digest FROM original)";
        let count = self
            .connection
            .query_row(question, [], |row| row.get::<_, i64>(0));
        Ok(self.read(count)?.max(0) as usize)
    }

    /// Where the files of an original lay when they were read.
    ///
    /// # Errors
    /// When the library can't be read.
    pub fn files(&self, id: OriginalId) -> Result<Vec<FileRecord>, LibraryError> {
        let rows = || -> rusqlite::Result<Vec<FileRecord>> {
            let mut statement = self
                .connection
                .prepare("SELECT path, size, modified FROM file WHERE original = ?1 ORDER BY path")?;
            let rows = statement.query_map([id.0], |row| {
                Ok(FileRecord {
                    path: row.get(0)?,
                    size: row.get::<_, i64>(1)?.max(0) as u64,
                    modified: row.get(2)?,
                })
            })?;
            rows.collect()
        };
        self.read(rows())
    }

    /// Hands over what an index has of all originals, by numbers.
    pub(crate) fn each_summary(
        &self,
        job: &Job,
        mut take: impl FnMut(OriginalId, Summary),
    ) -> Result<(), LibraryError> {
        let mut statement = self.read(self.connection.prepare(
            "SELECT original, whole, smooth, local, words, stars FROM descriptor ORDER BY original",
        ))?;
        let mut rows = self.read(statement.query([]))?;
        while let Some(row) = self.read(rows.next())? {
            job.go_on()?;
            let id = self.read(row.get::<_, i64>(0))?;
            let words = self.blob(row, 4)?.chunks(2).map(|word| match *word {
                [low, high] => usize::from(u16::from_le_bytes([low, high])),
                _ => WORDS,
            });
            let words: Vec<u16> = words
                .map(|word| u16::try_from(word).ok().filter(|_| word < WORDS))
                .collect::<Option<_>>()
                .ok_or_else(|| self.damaged(format!("original {id} has a word that there is not")))?;
            let summary = Summary {
                whole: self.bytes(row, 1)?,
                smooth: self.bytes(row, 2)?,
                local: self.bytes::<LOCAL_LENGTH>(row, 3)?,
                words,
                stars: self.stars(row, 5)?,
            };
            take(OriginalId(id), summary);
        }
        Ok(())
    }

    /// The surface of an original.
    pub(crate) fn surface(&self, id: OriginalId) -> Result<Vec<u8>, LibraryError> {
        let question = "SELECT bytes FROM surface WHERE original = ?1";
        let bytes = self
            .connection
            .query_row(question, [id.0], |row| row.get::<_, Vec<u8>>(0));
        let bytes = self.read(bytes)?;
        match bytes.len() == SURFACE_LENGTH {
            true => Ok(bytes),
            false => Err(self.damaged(format!("the surface of original {id} has another length"))),
        }
    }

    fn records(
        &self,
        which: &str,
        given: impl rusqlite::Params,
    ) -> Result<Vec<OriginalRecord>, LibraryError> {
        let rows = || -> rusqlite::Result<Vec<OriginalRecord>> {
            let question = format!(
                "SELECT id, digest, name, vertices, triangles,
                    (SELECT length(packed) FROM geometry WHERE geometry.original = original.id),
                    (SELECT count(*) FROM certificate WHERE certificate.original = original.digest)
                FROM original {which}"
            );
            let mut statement = self.connection.prepare(&question)?;
            let count = |row: &Row<'_>, i| Ok::<_, rusqlite::Error>(row.get::<_, i64>(i)?.max(0) as usize);
            let rows = statement.query_map(given, |row| {
                let digest = row.get::<_, String>(1)?.parse().map_err(|problem: String| {
                    rusqlite::Error::FromSqlConversionFailure(1, Type::Text, problem.into())
                })?;
                Ok(OriginalRecord {
                    id: OriginalId(row.get(0)?),
                    digest,
                    name: row.get(2)?,
                    vertices: count(row, 3)?,
                    triangles: count(row, 4)?,
                    geometry_bytes: row.get::<_, Option<i64>>(5)?.map(|bytes| bytes.max(0) as usize),
                    certificates: count(row, 6)?,
                })
            })?;
            rows.collect()
        };
        self.read(rows())
    }

    fn bytes<const N: usize>(&self, row: &Row<'_>, column: usize) -> Result<[u8; N], LibraryError> {
        let bytes = self.blob(row, column)?;
        bytes.try_into().map_err(|_| {
            self.damaged(format!(
                "a descriptor has {} bytes where it has to have {N}",
                bytes.len()
            ))
        })
    }

    fn stars(&self, row: &Row<'_>, column: usize) -> Result<Vec<Star>, LibraryError> {
        let bytes = self.blob(row, column)?;
        let (stars, rest) = bytes.as_chunks::<STAR>();
        match rest.is_empty() && stars.len() <= STARS {
            true => Ok(stars.iter().map(Star::of).collect()),
            false => Err(self.damaged(format!("a descriptor has {} bytes of stars", bytes.len()))),
        }
    }

    fn blob<'r>(&self, row: &'r Row<'_>, column: usize) -> Result<&'r [u8], LibraryError> {
        let bytes = self.read(row.get_ref(column))?.as_blob();
        bytes.map_err(|error| self.damaged(error.to_string()))
    }

    /// One transaction, for which the others wait.
    fn write<T>(
        &mut self,
        work: impl FnOnce(&Transaction<'_>) -> rusqlite::Result<T>,
    ) -> Result<T, LibraryError> {
        let done = || {
            let transaction = self
                .connection
                .transaction_with_behavior(TransactionBehavior::Immediate)?;
            let result = work(&transaction)?;
            transaction.commit()?;
            Ok(result)
        };
        let done: rusqlite::Result<T> = done();
        done.map_err(|error| opening::of(&self.path, error))
    }

    fn read<T>(&self, result: rusqlite::Result<T>) -> Result<T, LibraryError> {
        result.map_err(|error| opening::of(&self.path, error))
    }

    fn damaged(&self, problem: String) -> LibraryError {
        LibraryError::Damaged {
            path: self.path.clone(),
            problem,
        }
    }
}

fn insert(transaction: &Transaction<'_>, digest: &str, entry: &Entry) -> rusqlite::Result<i64> {
    transaction.execute(
        "INSERT INTO original (digest, name, vertices, triangles) VALUES (?1, ?2, ?3, ?4)",
        params![digest, entry.name, entry.vertices as i64, entry.triangles as i64],
    )?;
    let id = transaction.last_insert_rowid();
    let summary = &entry.descriptor.summary;
    let words: Vec<u8> = summary.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let stars: Vec<u8> = summary.stars.iter().flat_map(Star::bytes).collect();
    transaction.execute(
        "INSERT INTO descriptor VALUES (?1, ?2, ?3, ?4, ?5, ?6)",
        params![id, summary.whole, summary.smooth, summary.local, words, stars],
    )?;
    transaction.execute(
        "INSERT INTO surface VALUES (?1, ?2)",
        params![id, entry.descriptor.surface],
    )?;
    Ok(id)
}

/// Notes a file, in place of what was noted of its path.
fn note(
    transaction: &Transaction<'_>,
    file: &FileRecord,
    original: Option<i64>,
    certificate: Option<&[u8]>,
) -> rusqlite::Result<()> {
    transaction.execute(
        "INSERT OR REPLACE INTO file VALUES (?1, ?2, ?3, ?4, ?5)",
        params![file.path, file.size as i64, file.modified, original, certificate],
    )?;
    Ok(())
}
