//! A process of a function, from its cold start to its end.
//!
//! It ends with the invoker: dropping it kills the process. If the invoker is killed, the process ends by itself,
//! because its standard input is a pipe of the invoker, which the system then closes. Without this it would continue to
//! draw for minutes before it noticed that its Runtime API is gone.

use std::process::Stdio;
use std::time::{Duration, Instant};

use tokio::io::{AsyncBufReadExt, AsyncRead, BufReader};
use tokio::process::{Child, ChildStdin, Command};

use super::meter::Meter;
use super::runtime_api::{Call, Handout, RuntimeApi};
use super::settings::Settings;
use crate::error::{Error, Result};
use crate::observation::{Attempt, Observer, Outcome, Requests, Seen};
use crate::routes::Function;

/// The time that Lambda gives a process before its first call of `next`.
const INIT_TIMEOUT: Duration = Duration::from_secs(10);

/// The variable that makes the project's functions end when their standard input ends. The crate of the functions reads
/// it.
const LIFELINE: &str = "RAYFOLD_ENDS_WITH_STDIN";

/// A process, warm after its first invocation.
pub(crate) struct Sandbox {
    function: Function,
    child: Child,
    /// The invoker's end of the pipe. The system closes it when the invoker ends, also by SIGKILL. It is no part of `child`,
    /// because waiting for a child closes its standard input.
    _lifeline: Option<ChildStdin>,
    api: RuntimeApi,
    meter: Option<Meter>,
    started: Instant,
    init: Option<Duration>,
    pub(crate) idle_since: Instant,
}

/// The end of an attempt, with its cost.
pub(crate) struct End {
    pub(crate) outcome: Outcome,
    pub(crate) took: Duration,
    pub(crate) init: Option<Duration>,
    pub(crate) requests: Requests,
    /// The process can take another.
    pub(crate) is_reusable: bool,
}

impl Sandbox {
    pub(crate) async fn start(function: Function, settings: &Settings, observer: &Observer) -> Result<Self> {
        let api = RuntimeApi::start().await?;
        let meter = match settings.store {
            Some(store) => Some(Meter::start(store, settings.fates.clone(), observer.clone()).await?),
            None => None,
        };
        let program = settings.functions.path(function);
        let name = format!("rayfold-{function}");
        let started = Instant::now();
        let mut child = Command::new(&program)
            .env_clear()
            .envs(settings.environment.iter().cloned())
            .envs(settings.environment_of.get(&function).into_iter().flatten().cloned())
            .envs(meter.as_ref().map(|meter| ("AWS_ENDPOINT_URL", meter.endpoint())))
            .env("AWS_LAMBDA_RUNTIME_API", api.endpoint())
            .env("AWS_LAMBDA_FUNCTION_NAME", &name)
            .env("AWS_LAMBDA_FUNCTION_MEMORY_SIZE", settings.memory_mb.to_string())
            .env("AWS_LAMBDA_FUNCTION_VERSION", "$LATEST")
            .env("AWS_LAMBDA_INITIALIZATION_TYPE", "on-demand")
            .env("AWS_LAMBDA_LOG_GROUP_NAME", format!("/aws/lambda/{name}"))
            .env("AWS_LAMBDA_LOG_STREAM_NAME", format!("local/{}", api.address.port()))
            .env("AWS_EXECUTION_ENV", "AWS_Lambda_provided.al2023")
            .env("TZ", ":UTC")
            .env(LIFELINE, "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // A Ctrl-C in the terminal is the invoker's to answer.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()
            .map_err(|source| Error::Spawn { program, source })?;
        listen_to(function, child.stdout.take(), observer);
        listen_to(function, child.stderr.take(), observer);
        let _lifeline = child.stdin.take();
        Ok(Self { function, child, _lifeline, api, meter, started, init: None, idle_since: started })
    }

    pub(crate) fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Hands out the invocation and waits for its end, at most until its deadline.
    pub(crate) async fn invoke(
        &mut self,
        handout: Handout,
        number: u32,
        kill_after: Option<Duration>,
        observer: &Observer,
    ) -> End {
        let attempt = Attempt {
            function: self.function,
            request_id: handout.request_id.clone(),
            number,
            pid: self.child.id().unwrap_or_default(),
        };
        let timeout = handout.timeout;
        let is_cold = self.init.is_none();
        if let Some(meter) = &self.meter {
            meter.begin(attempt.clone());
        }
        observer.see(Seen::Started(attempt.clone()));
        self.api.hand_out(handout);
        let mut began = Instant::now();
        let mut limit = if is_cold { INIT_TIMEOUT } else { timeout };
        let mut kill_at = None;
        let (outcome, is_reusable) = loop {
            tokio::select! {
                biased;
                call = self.api.call() => match call {
                    Call::Next => {
                        self.init.get_or_insert_with(|| self.started.elapsed());
                    }
                    Call::Taken => {
                        began = Instant::now();
                        limit = timeout;
                        kill_at = kill_after.map(|after| began + after);
                    }
                    Call::Response(body) => break (Outcome::Succeeded(body), true),
                    Call::Error(body) => break (Outcome::Failed(body), true),
                    Call::InitError(body) => break (Outcome::Failed(body), false),
                },
                status = self.child.wait() => {
                    let status = status.map_or_else(|e| e.to_string(), |status| status.to_string());
                    break (Outcome::Crashed(status), false);
                }
                () = killed(self.meter.as_ref()) => {
                    self.kill().await;
                    break (Outcome::Crashed("killed at a request".into()), false);
                }
                () = until(kill_at) => {
                    self.kill().await;
                    break (Outcome::Crashed("killed by chance".into()), false);
                }
                () = until(Some(began + limit)) => {
                    self.kill().await;
                    break (Outcome::TimedOut, false);
                }
            }
        };
        self.idle_since = Instant::now();
        let end = End {
            outcome,
            took: began.elapsed(),
            init: self.init.filter(|_| is_cold),
            requests: self.meter.as_ref().map(Meter::requests).unwrap_or_default(),
            is_reusable,
        };
        observer.see(Seen::Finished {
            attempt,
            outcome: end.outcome.clone(),
            took: end.took,
            init: end.init,
            requests: end.requests,
        });
        end
    }

    async fn kill(&mut self) {
        // One that is gone already needs no killing.
        let _ = self.child.kill().await;
    }
}

async fn killed(meter: Option<&Meter>) {
    match meter {
        Some(meter) => meter.killed().await,
        None => std::future::pending().await,
    }
}

async fn until(at: Option<Instant>) {
    match at {
        Some(at) => tokio::time::sleep_until(at.into()).await,
        None => std::future::pending().await,
    }
}

fn listen_to(
    function: Function,
    stream: Option<impl AsyncRead + Unpin + Send + 'static>,
    observer: &Observer,
) {
    let Some(stream) = stream else { return };
    let observer = observer.clone();
    tokio::spawn(async move {
        let mut lines = BufReader::new(stream).lines();
        while let Ok(Some(line)) = lines.next_line().await {
            observer.see(Seen::Log { function, line });
        }
    });
}
