//! `plotplan studio`: serves the page that compiles in the browser.
//!
//! The files are read once and served from memory by their exact names, so that no path of a request
//! reaches the file system. The server listens on 127.0.0.1 only. A page of another site can still send
//! requests there, and a name of its own can lead there (DNS rebinding): such requests have another
//! `Host` or `Origin` and are refused.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;

use crate::cli::Studio;
use crate::failure::Failure;
use crate::terminal;

/// The studio's files in this program; none if it was built without them (`build.rs`).
const BUILT_IN: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/studio.rs"));

/// What the page may do; also in the page itself, for other hosts.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self'; \
                      img-src data:; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A connection is closed when nothing happens on it for this time.
const PATIENCE: Duration = Duration::from_secs(20);
/// Connections at the same time; more are closed at once.
const MOST_CONNECTIONS: usize = 64;
/// Bytes of a request at most.
const MOST_HEAD: usize = 16 << 10;

/// The studio's files by their paths.
type Files = BTreeMap<String, Vec<u8>>;

pub(crate) fn run(arguments: &Studio) -> Result<(), Failure> {
    let files = match &arguments.files {
        Some(folder) => {
            let mut files = Files::new();
            read(Path::new(folder), "", &mut files)
                .with_context(|| format!("cannot read the studio's files in {folder}"))
                .map_err(Failure::Io)?;
            files
        }
        None => BUILT_IN.iter().map(|(name, bytes)| ((*name).to_owned(), bytes.to_vec())).collect(),
    };
    if !files.contains_key("index.html") {
        let what = match &arguments.files {
            Some(folder) => format!("{folder} holds no index.html: `cargo xtask web` makes target/studio"),
            None => "this program was built without the studio: give --files FOLDER, which `cargo xtask web` makes (target/studio), or build with PLOTPLAN_STUDIO=target/studio".to_owned(),
        };
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    }
    let listener = TcpListener::bind(("127.0.0.1", arguments.port))
        .and_then(|listener| Ok((listener.local_addr()?.port(), listener)))
        .with_context(|| {
            format!("cannot listen on port {} of 127.0.0.1; --port takes another", arguments.port)
        })
        .map_err(Failure::Io)?;
    let (port, listener) = listener;
    let address = format!("http://127.0.0.1:{port}/");
    terminal::always(&format!("studio at {address} until Ctrl-C\n"));
    if !arguments.no_open
        && let Err(error) = open::that_detached(&address)
    {
        terminal::say(&format!("no browser was opened ({error}): open the address yourself\n"));
    }
    let files = Arc::new(files);
    let connections = Arc::new(());
    for stream in listener.incoming() {
        let Ok(stream) = stream else { continue };
        if Arc::strong_count(&connections) > MOST_CONNECTIONS {
            continue;
        }
        let (files, connection) = (Arc::clone(&files), Arc::clone(&connections));
        // A thread for each: browsers open connections in advance, and some stay silent.
        std::thread::spawn(move || {
            // The browser may have gone away; the next connection does not depend on it.
            let _ = converse(stream, &files, port);
            drop(connection);
        });
    }
    Ok(())
}

/// Reads a request, answers it and closes the connection.
fn converse(mut stream: TcpStream, files: &Files, port: u16) -> std::io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut head = Vec::new();
    let mut chunk = [0; 4096];
    let answer = loop {
        let length = stream.read(&mut chunk)?;
        head.extend_from_slice(&chunk[..length]);
        let mut headers = [httparse::EMPTY_HEADER; 64];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(&head) {
            Ok(httparse::Status::Complete(_)) => break answer(files, port, &request),
            Ok(httparse::Status::Partial) if length > 0 && head.len() < MOST_HEAD => {}
            _ => break Answer::plain(400, "not a request"),
        }
    };
    let is_head = head.starts_with(b"HEAD ");
    stream.write_all(answer.head().as_bytes())?;
    if !is_head {
        stream.write_all(&answer.body)?;
    }
    stream.shutdown(Shutdown::Write)
}

/// Reads the files below a folder.
fn read(folder: &Path, prefix: &str, files: &mut Files) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let name = format!("{prefix}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            read(&path, &format!("{name}/"), files)?;
        } else {
            files.insert(name, std::fs::read(&path)?);
        }
    }
    Ok(())
}

/// The value of a request's header; `None` where it is missing, empty where it is there twice.
fn header<'a>(request: &'a httparse::Request<'_, '_>, name: &str) -> Option<&'a str> {
    let mut found = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
    let value = std::str::from_utf8(found.next()?.value).unwrap_or_default();
    Some(if found.next().is_some() { "" } else { value })
}

fn answer<'a>(files: &'a Files, port: u16, request: &httparse::Request<'_, '_>) -> Answer<'a> {
    let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_own = |host: &str| hosts.iter().any(|own| own == host);
    let is_own_origin = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
    if !header(request, "Host").is_some_and(is_own) || !header(request, "Origin").is_none_or(is_own_origin) {
        return Answer::plain(403, "this server answers its own page only");
    }
    if !matches!(request.method, Some("GET" | "HEAD")) {
        return Answer::plain(405, "only GET and HEAD");
    }
    let path = request.path.unwrap_or_default().split(['?', '#']).next().unwrap_or_default();
    let name = match path.strip_prefix('/') {
        Some("") => "index.html",
        Some(name) => name,
        None => return Answer::plain(400, "not a path"),
    };
    match files.get(name) {
        Some(body) => Answer { status: 200, media_type: media_type(name), body: Cow::Borrowed(body) },
        None => Answer::plain(404, "no such file"),
    }
}

/// An answer to a request.
struct Answer<'a> {
    status: u16,
    media_type: &'static str,
    body: Cow<'a, [u8]>,
}

impl Answer<'_> {
    fn plain(status: u16, text: &'static str) -> Self {
        Self { status, media_type: "text/plain; charset=utf-8", body: Cow::Borrowed(text.as_bytes()) }
    }

    /// Status and headers.
    fn head(&self) -> String {
        let reason = match self.status {
            200 => "OK",
            400 => "Bad Request",
            403 => "Forbidden",
            404 => "Not Found",
            _ => "Method Not Allowed",
        };
        let length = self.body.len().to_string();
        let headers = [
            ("Content-Type", self.media_type),
            ("Content-Length", &length),
            ("Content-Security-Policy", POLICY),
            ("X-Content-Type-Options", "nosniff"),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Cross-Origin-Opener-Policy", "same-origin"),
            ("Referrer-Policy", "no-referrer"),
            // A new program has new files at the same address.
            ("Cache-Control", "no-cache"),
            ("Connection", "close"),
        ];
        let lines: Vec<String> = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
        format!("HTTP/1.1 {} {reason}\r\n{}\r\n", self.status, lines.concat())
    }
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit_once('.').map_or("", |(_, extension)| extension) {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "wasm" => "application/wasm",
        _ => "application/octet-stream",
    }
}
