//! `plotplan studio`: serves the page that compiles in the browser.
//!
//! The files are read once and served from memory by their exact names, so that no path of a request
//! reaches the file system. The server listens on 127.0.0.1 only. A page of another site can still send
//! requests there, and a name of its own can lead there (DNS rebinding): such requests have another
//! `Host` or `Origin` and are refused.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

use anyhow::Context as _;
use tiny_http::{Header, Method, Request, Response, Server};

use crate::cli::Studio;
use crate::failure::Failure;
use crate::terminal;

/// The studio's files in this program; none if it was built without them (`build.rs`).
const BUILT_IN: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/studio.rs"));

/// What the page may do; also in the page itself, for other hosts.
const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; connect-src 'self'; \
                      img-src data:; worker-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

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
    let server = Server::http(("127.0.0.1", arguments.port))
        .map_err(|error| {
            anyhow::anyhow!(
                "cannot listen on port {} of 127.0.0.1: {error}; --port takes another",
                arguments.port
            )
        })
        .map_err(Failure::Io)?;
    let port = server.server_addr().to_ip().map_or(arguments.port, |address| address.port());
    let address = format!("http://127.0.0.1:{port}/");
    terminal::always(&format!("studio at {address} until Ctrl-C\n"));
    if !arguments.no_open
        && let Err(error) = open::that_detached(&address)
    {
        terminal::say(&format!("no browser was opened ({error}): open the address yourself\n"));
    }
    for request in server.incoming_requests() {
        let answer = answer(&files, port, &request);
        // The browser may have gone away; the next request does not depend on it.
        let _ = request.respond(answer);
    }
    Ok(())
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

/// The value of a request's header.
fn header<'a>(request: &'a Request, name: &'static str) -> Option<&'a str> {
    request.headers().iter().find(|header| header.field.equiv(name)).map(|header| header.value.as_str())
}

fn answer(files: &Files, port: u16, request: &Request) -> Response<Cursor<Vec<u8>>> {
    let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_own = |host: &str| hosts.iter().any(|own| own == host);
    let is_own_origin = |origin: &str| origin.strip_prefix("http://").is_some_and(is_own);
    if !header(request, "Host").is_some_and(is_own) || !header(request, "Origin").is_none_or(is_own_origin) {
        return plain(403, "this server answers its own page only");
    }
    if !matches!(request.method(), Method::Get | Method::Head) {
        return plain(405, "only GET and HEAD");
    }
    let path = request.url().split(['?', '#']).next().unwrap_or_default();
    let name = match path.strip_prefix('/') {
        Some("") => "index.html",
        Some(name) => name,
        None => return plain(400, "not a path"),
    };
    let Some(bytes) = files.get(name) else { return plain(404, "no such file") };
    with_headers(Response::from_data(bytes.clone()), media_type(name))
}

fn plain(status: u16, text: &str) -> Response<Cursor<Vec<u8>>> {
    with_headers(Response::from_string(text).with_status_code(status), "text/plain; charset=utf-8")
}

fn with_headers(response: Response<Cursor<Vec<u8>>>, media_type: &str) -> Response<Cursor<Vec<u8>>> {
    let headers = [
        ("Content-Type", media_type),
        ("Content-Security-Policy", POLICY),
        ("X-Content-Type-Options", "nosniff"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Cross-Origin-Opener-Policy", "same-origin"),
        ("Referrer-Policy", "no-referrer"),
        // A new program has new files at the same address.
        ("Cache-Control", "no-cache"),
    ];
    let made = headers.iter().filter_map(|(name, value)| Header::from_bytes(*name, *value).ok());
    made.fold(response, Response::with_header)
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
