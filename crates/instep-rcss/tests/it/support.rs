//! What tests share: a player's parts, and the real server in a virtual environment that the test makes under `target/`
//! (needs python3 with venv, and the package registry once). A machine that cannot make it fails the test: a check that is
//! silently left out checks nothing.

use std::fs::File;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex};
use std::time::{Duration, Instant};

use instep_behaviour::{KickTable, Strategy};
use instep_field::Field;
use instep_rcss::{RcssError, Roster, Setup, Tally};
use instep_robot::Robot;

/// The release whose protocol the crate was written for.
const PACKAGE: &str = "rcsssmj==0.2.1";

static ROBOT: LazyLock<Robot> =
    LazyLock::new(|| Robot::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/t1")).unwrap());

/// A server at `port` on this machine.
pub(crate) fn setup(port: u16, duration: f64) -> Setup {
    Setup { host: "127.0.0.1".into(), port, duration: Some(duration), patience: 1.0, record: Some(0.1) }
}

/// Plays; gives the tallies, or why not, and all that was said.
pub(crate) fn play(
    setup: &Setup,
    team: &str,
    numbers: &[u8],
    stop: &AtomicBool,
) -> (Result<Vec<Tally>, RcssError>, Vec<String>) {
    let settings = instep_rcss::settings(&ROBOT, Strategy::default(), &KickTable { kick: Vec::new() }).unwrap();
    let field = Arc::new(Field::named("simulation").unwrap());
    let said = Mutex::new(Vec::new());
    let say = |line: String| said.lock().unwrap().push(line);
    let result = instep_rcss::play(setup, &ROBOT, &field, Roster { team, numbers }, &settings, stop, &say);
    (result, said.into_inner().unwrap())
}

/// A port that was free a moment ago; the next one too.
pub(crate) fn port() -> u16 {
    loop {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        if port < u16::MAX && TcpListener::bind(("127.0.0.1", port + 1)).is_ok() {
            return port;
        }
    }
}

fn succeed(what: &str, command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{what}: {e}; this test needs python3 with venv"));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{what}: {}\n{out}{err}", output.status);
    output
}

/// The Python that has the server.
fn python() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rcsssmj");
    let python = folder.join("bin/python");
    // Tests may run side by side, and in several processes: one makes it, the others wait.
    let lock = File::create(Path::new(env!("CARGO_TARGET_TMPDIR")).join("rcsssmj.lock")).unwrap();
    lock.lock().unwrap();
    let made = folder.join(PACKAGE);
    if !made.exists() {
        succeed("python3 -m venv", Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder));
        let mut pip = Command::new(&python);
        succeed("pip install", pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", PACKAGE]));
        File::create(made).unwrap();
    }
    python
}

/// The real server, which waits for its players and is never faster than the clock: what a test tells it comes at the same time of
/// the game on an idle machine.
pub(crate) struct Server {
    child: Child,
    /// Its port for players; the one for monitors is the next.
    pub(crate) port: u16,
}

impl Server {
    /// Starts it at `port` and waits until it listens.
    pub(crate) fn start(port: u16) -> Self {
        // It writes its console.log where it is started.
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("rcsssmj-{port}"));
        std::fs::create_dir_all(&folder).unwrap();
        // A log of another time would tell of other players.
        let _ = std::fs::remove_file(folder.join("console.log"));
        let [players, monitors] = [port, port + 1].map(|port| port.to_string());
        let child = Command::new(python())
            .args(["-m", "rcsssmj", "--no-render", "--sync"])
            .args(["--aport", &players, "--mport", &monitors])
            .current_dir(folder)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let server = Self { child, port };
        let begin = Instant::now();
        while TcpStream::connect(("127.0.0.1", port + 1)).is_err() {
            assert!(begin.elapsed().as_secs() < 60, "the server does not listen at port {port}");
            std::thread::sleep(Duration::from_millis(100));
        }
        server
    }

    /// Waits until a player has joined and has had some cycles: its log says who comes.
    pub(crate) fn joined(&self) {
        let log = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("rcsssmj-{}", self.port)).join("console.log");
        let begin = Instant::now();
        while !std::fs::read_to_string(&log).unwrap_or_default().contains("activated") {
            assert!(begin.elapsed().as_secs() < 90, "nobody joins at port {}", self.port);
            std::thread::sleep(Duration::from_millis(100));
        }
        std::thread::sleep(Duration::from_secs(2));
    }

    /// Tells it what a monitor may tell.
    pub(crate) fn tell(&self, commands: &[&str]) {
        let mut monitor = TcpStream::connect(("127.0.0.1", self.port + 1)).unwrap();
        for command in commands {
            let mut bytes = u32::try_from(command.len()).unwrap().to_be_bytes().to_vec();
            bytes.extend_from_slice(command.as_bytes());
            monitor.write_all(&bytes).unwrap();
        }
        // Left open for as long as it takes to be read.
        std::thread::sleep(Duration::from_millis(300));
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
