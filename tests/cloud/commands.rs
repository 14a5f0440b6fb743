//! The subcommands that use a bucket, with an S3 server, the local invoker and the unmodified function binaries.

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::stage::stores::on_every_store;
use super::stage::{PATIENCE, Stage, built, drawn, functions_beside, scene};
use rayfold_local::StoreKind;
use rayfold_local::invoker::Settings;
use rayfold_pipeline::manifest::Status;
use rayfold_pipeline::store::{ListRequest, Store};

const RAYFOLD: &str = env!("CARGO_BIN_EXE_rayfold");

/// A bucket with its functions, and a working folder.
struct Cloud {
    stage: Stage,
    folder: tempfile::TempDir,
}

async fn cloud(store: StoreKind, change: impl FnOnce(&mut Settings)) -> Cloud {
    let functions = functions_beside(Path::new(RAYFOLD));
    Cloud { stage: super::stage::stage(store, functions, change).await, folder: tempfile::tempdir().unwrap() }
}

impl Cloud {
    fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn delete(&self, name: &str) {
        std::fs::remove_file(self.folder.path().join(name)).unwrap();
    }

    fn command(&self, args: &str) -> Command {
        let mut command = Command::new(RAYFOLD);
        command
            .args(args.split_whitespace())
            .current_dir(self.folder.path())
            .envs(self.stage.platform.server().environment())
            .env("RAYFOLD_BUCKET", self.stage.store().bucket())
            .stdin(Stdio::null());
        command
    }

    /// Runs `rayfold`, which must end with `code`.
    fn rayfold(&self, args: &str, code: i32) -> Output {
        let output = self.command(args).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "rayfold {args}: {said}");
        output
    }

    /// Returns the messages of a run.
    fn says(&self, args: &str, code: i32) -> String {
        String::from_utf8(self.rayfold(args, code).stderr).unwrap()
    }

    /// Returns the standard output of a run.
    fn prints(&self, args: &str) -> String {
        String::from_utf8(self.rayfold(args, 0).stdout).unwrap()
    }

    /// Returns the keys below a prefix, without that of the running invoker.
    async fn keys(&self, prefix: &str) -> Vec<String> {
        let page = self.stage.store().list(ListRequest::all(prefix)).await.unwrap();
        let keys = page.objects.into_iter().map(|object| object.key);
        keys.filter(|key| !key.starts_with("invokers/")).collect()
    }

    /// Returns the number of frames drawn and GIFs built since the last call.
    async fn work(&mut self) -> (usize, u64) {
        self.stage.settle().await;
        let seen = self.stage.seen();
        (drawn(&seen), built(&seen))
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_submitted_folder_becomes_the_gif_that_render_makes() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        for (name, x) in [("f1", 8.0), ("f2", 12.0), ("f10", 16.0)] {
            cloud.write(&format!("film/{name}.txt"), scene(x));
        }
        cloud.write("film/notes.md", "not a script");
        let said = cloud.says("submit film", 0);
        assert!(said.contains("scripts/film/: 3 files uploaded"), "{said}");
        cloud.rayfold("render film -o local.gif", 0);
        assert!(cloud.read("film.gif") == cloud.read("local.gif"), "the GIF is not the local one");
        assert_eq!(cloud.work().await, (3, 1), "no quiet period was waited for, nothing done twice");
        let files = ["animation.json", "f1.txt", "f10.txt", "f2.txt"];
        assert_eq!(cloud.keys("scripts/").await, files.map(|name| format!("scripts/film/{name}")));

        // A repetition: no upload, no work.
        let said = cloud.says("submit film -o again.gif", 0);
        assert!(said.contains("up to date"), "{said}");
        assert_eq!(cloud.read("again.gif"), cloud.read("film.gif"));
        assert_eq!(cloud.work().await, (0, 0));

        // One changed, one added, one deleted: two frames are drawn.
        cloud.write("film/f2.txt", scene(13.0));
        cloud.write("film/f11.txt", scene(20.0));
        cloud.delete("film/f1.txt");
        let said = cloud.says("submit film --delete", 0);
        assert!(said.contains("1 script that the folder does not have: deleted"), "{said}");
        assert!(said.contains("2 files uploaded") && said.contains("unchanged"), "{said}");
        cloud.rayfold("render film -o local.gif", 0);
        assert!(cloud.read("film.gif") == cloud.read("local.gif"), "the GIF is not the local one");
        assert_eq!(cloud.work().await.0, 2);

        // The status, for users and for programs.
        let table = cloud.prints("status");
        assert!(table.starts_with("film  done       3 of 3 frames, GIF of "), "{table}");
        assert_eq!(cloud.prints("status film --watch"), table);
        let report: serde_json::Value =
            serde_json::from_str(&cloud.prints("status film --format json")).unwrap();
        let film = &report["animations"][0];
        assert_eq!((&film["animation"], &film["status"]), (&"film".into(), &"done".into()));
        assert_eq!((&film["done"], &film["gif"]["current"]), (&3.into(), &true.into()));
        let text = cloud.prints("status film --format json");
        assert_eq!(text.matches("\n      \"gif\": ").count(), 1, "a key that is there twice: {text}");

        // Fetches the GIF, and the frames, which equal those drawn locally.
        cloud.rayfold("fetch film -o fetched.gif", 0);
        assert_eq!(cloud.read("fetched.gif"), cloud.read("film.gif"));
        cloud.rayfold("fetch film -o c%d.png", 0);
        cloud.rayfold("render film -o l%d.png", 0);
        for number in 1..=3 {
            let image = |side| image::load_from_memory(&cloud.read(&format!("{side}{number}.png"))).unwrap();
            assert_eq!(image("c"), image("l"), "frame {number}");
        }

        // Frames are redrawn on demand, with the same picture.
        let said = cloud.says("retry film", 0);
        assert!(said.contains("nothing failed and nothing is missing"), "{said}");
        let said = cloud.says("retry film --all", 0);
        assert!(said.contains("3 frames rendered again"), "{said}");
        cloud.stage.until("film", Status::Done).await;
        assert_eq!(cloud.work().await.0, 3);
        cloud.rayfold("fetch film -o fetched.gif", 0);
        assert_eq!(cloud.read("fetched.gif"), cloud.read("film.gif"));
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_submitted_folder_becomes_all_files_that_it_asks_for() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        cloud.write("film/1.txt", scene(8.0));
        cloud.write("film/2.txt", scene(12.0));
        cloud.write("film/animation.json", "{\"outputs\": [\"webp\", \"gif\"], \"bounce\": true}");
        let said = cloud.says("submit film -o film.apng", 1);
        let right = "add \"outputs\": [\"webp\", \"gif\", \"apng\"] to its animation.json";
        assert!(said.contains("no APNG is made of film, but WebP and GIF") && said.contains(right), "{said}");
        assert_eq!(cloud.keys("scripts/").await, [""; 0]);

        cloud.rayfold("submit film", 0);
        for ending in ["webp", "gif"] {
            cloud.rayfold(&format!("render film -o local.{ending}"), 0);
            assert!(
                cloud.read(&format!("film.{ending}")) == cloud.read(&format!("local.{ending}")),
                "{ending}"
            );
        }
        assert_eq!(cloud.work().await, (2, 2));
        let table = cloud.prints("status");
        assert!(table.contains("2 of 2 frames, WebP of ") && table.contains(", GIF of "), "{table}");
        let report: serde_json::Value =
            serde_json::from_str(&cloud.prints("status film --format json")).unwrap();
        let film = &report["animations"][0];
        assert_eq!(film["outputs"]["webp"]["key"], "animations/film.webp");
        assert_eq!(
            (&film["outputs"]["webp"]["current"], &film["gif"]["current"]),
            (&true.into(), &true.into())
        );
        cloud.rayfold("fetch film -o fetched.webp", 0);
        assert_eq!(cloud.read("fetched.webp"), cloud.read("film.webp"));
        let said = cloud.says("fetch film -o fetched.y4m", 1);
        assert!(said.contains("no Y4M is made of film"), "{said}");

        cloud.rayfold("remove film --delete", 0);
        assert_eq!(cloud.keys("").await, [""; 0]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn removing_leaves_nothing_of_an_animation_and_everything_of_others() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        cloud.write("a/f.txt", scene(8.0));
        cloud.write("b/f.txt", scene(9.0) + "Background 1 0 0\nTrace\n");
        cloud.rayfold("submit a --name film", 0);
        cloud.rayfold("submit b --name film/two", 0);
        let said = cloud.says("submit b/f.txt", 0);
        assert!(said.contains("/scripts/f/: 1 file uploaded"), "{said}");
        cloud.rayfold("remove f --delete", 0);
        let said = cloud.says("remove film --delete", 0);
        assert!(said.starts_with("film: ") && said.contains("removed"), "{said}");
        cloud.stage.settle().await;
        let left = cloud.keys("").await;
        assert!(!left.is_empty() && left.iter().all(|key| key.contains("film/two")), "{left:?}");
        let table = cloud.prints("status");
        assert!(table.starts_with("film/two  done       2 of 2 frames"), "{table}");
        for command in [
            "remove film",
            "remove film --delete",
            "status film",
            "status film --watch",
            "fetch film -o film.gif",
            "retry film",
        ] {
            let said = cloud.says(command, 1);
            assert_eq!(
                said,
                format!("error: there is no animation film in {}\n", cloud.stage.store().bucket())
            );
        }
    })
    .await;
}

/// Regression test: the marker of a folder counted as an animation that stayed new for ever, and files beside the
/// folders were listed nowhere.
#[tokio::test(flavor = "multi_thread")]
async fn what_is_ignored_misnamed_and_misplaced_is_what_the_status_says() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        for name in ["film/1.txt", "film/.old.txt", "film/._1.txt", "film/3.TXT"] {
            cloud.write(name, scene(8.0));
        }
        let said = cloud.says("submit film", 0);
        let warning = "warning: film/3.TXT: not read: expected the ending .txt in small letters";
        assert!(said.contains(warning) && said.contains("1 file uploaded"), "{said}");
        for key in ["scripts/film/._1.txt", "scripts/film/3.TXT", "scripts/1.txt", "Scripts/film/1.txt"] {
            cloud.stage.put(key, scene(9.0)).await;
        }
        cloud.work().await;
        let output = cloud.rayfold("status", 0);
        let (table, said) =
            (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
        assert!(table.starts_with("film  done       1 of 1 frame, GIF of "), "{table}");
        assert!(table.ends_with("; 1 warning\n"), "{table}");
        assert!(said.contains("2 objects misplaced"), "{said}");
        assert!(said.contains("scripts/1.txt") && said.contains("Scripts/film/1.txt"), "{said}");
        let said = cloud.says("status film", 0);
        assert!(said.contains("warning: scripts/film/3.TXT: not read"), "{said}");
        let report: serde_json::Value = serde_json::from_str(&cloud.prints("status --format json")).unwrap();
        assert_eq!(report["misplaced"]["count"], 2);
        assert_eq!(report["animations"][0]["warnings"][0]["key"], "scripts/film/3.TXT");
        cloud.rayfold("remove film --delete", 0);
        assert!(cloud.keys("scripts/film/").await.is_empty());
        cloud.work().await;
        assert_eq!(cloud.prints("status"), "");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_bad_script_uploads_nothing() {
    on_every_store(async |store| {
        let cloud = cloud(store, |_| {}).await;
        cloud.write("film/f1.txt", scene(8.0));
        cloud.write("film/f2.txt", "Screen 24 18\nSpere 1\nTrace\n");
        let said = cloud.says("submit film", 1);
        assert!(said.contains("film/f2.txt:2:1") && said.contains("did you mean `Sphere`?"), "{said}");
        assert!(said.ends_with("error: nothing was uploaded: 1 error in 1 of 2 files\n"), "{said}");
        assert!(cloud.keys("").await.is_empty());
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_fails_in_the_cloud_is_named_with_its_reason() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        cloud.write("film/f1.txt", scene(8.0));
        cloud.write("film/f2.txt", scene(9.0));
        cloud.rayfold("submit film", 0);
        // A script is uploaded without a check.
        cloud.stage.put("scripts/film/f2.txt", "Screen 24 18\nSpere 1\nTrace\n").await;
        cloud.stage.until("film", Status::Failed).await;
        let output = cloud.rayfold("status film --watch", 1);
        let (said, table) =
            (String::from_utf8(output.stderr).unwrap(), String::from_utf8(output.stdout).unwrap());
        assert!(table.starts_with("film  failed     1 of 2 frames, 1 failed, no GIF"), "{table}");
        assert!(said.contains("f2.txt:2:1") && said.contains("did you mean `Sphere`?"), "{said}");
        let said = cloud.says("fetch film -o film.gif", 1);
        assert!(
            said.contains("there is no GIF of film as it is now: failed (1 of 2 frames, 1 failed)"),
            "{said}"
        );
        let said = cloud.says("fetch film -o %d.png", 1);
        assert!(said.contains("f2.txt is not drawn"), "{said}");
        // The first command, repeated, corrects it.
        cloud.rayfold("submit film", 0);
        cloud.rayfold("render film -o local.gif", 0);
        assert!(cloud.read("film.gif") == cloud.read("local.gif"), "the GIF is not the local one");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn watching_an_animation_that_does_not_exist_never_ended() {
    on_every_store(async |store| {
        let cloud = cloud(store, |_| {}).await;
        let start = Instant::now();
        let said = cloud.says("status nothing --watch", 1);
        assert_eq!(
            said,
            format!("error: there is no animation nothing in {}\n", cloud.stage.store().bucket())
        );
        assert!(start.elapsed() < PATIENCE);
        // The command waits for an upload that begins a moment later.
        let watching = cloud.command("status film --watch").stdout(Stdio::piped()).spawn().unwrap();
        tokio::time::sleep(Duration::from_millis(500)).await;
        cloud.stage.put("scripts/film/f1.txt", scene(8.0)).await;
        let output = watching.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        let table = String::from_utf8(output.stdout).unwrap();
        assert!(
            table.lines().last().unwrap().starts_with("film  done       1 of 1 frame, GIF of "),
            "{table}"
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_last_gif_was_denied_while_it_was_being_replaced() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        cloud.write("film/f1.txt", scene(8.0));
        cloud.write("film/f2.txt", scene(9.0));
        cloud.rayfold("submit film", 0);
        // The beginning of an upload of three frames.
        cloud.stage.put("scripts/film/animation.json", "{\"frames\": 3}").await;
        cloud.stage.until("film", Status::Waiting).await;
        let table = cloud.prints("status film");
        assert!(table.starts_with("film  waiting    2 of 3 frames, last GIF of "), "{table}");
        assert!(table.ends_with(" old\n"), "{table}");
        let report: serde_json::Value =
            serde_json::from_str(&cloud.prints("status film --format json")).unwrap();
        let gif = &report["animations"][0]["gif"];
        assert!(gif["current"] == false && gif["modified_ms"].as_u64() > Some(1_000_000_000_000), "{gif}");
        let said = cloud.says("fetch film -o last.gif", 1);
        assert!(said.contains("waiting (2 of 3 frames); --last fetches the one before, of "), "{said}");
        let said = cloud.says("fetch film -o last.gif --last", 0);
        assert!(said.contains(" old and shows older scripts: film is waiting (2 of 3 frames)"), "{said}");
        assert!(cloud.read("last.gif") == cloud.read("film.gif"), "not the last GIF");
        cloud.says("fetch film -o %d.png --last", 2);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_failed_frame_kept_the_others_from_being_fetched() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        for (name, x) in [("f1", 8.0), ("f2", 9.0), ("f3", 10.0)] {
            cloud.write(&format!("film/{name}.txt"), scene(x));
        }
        cloud.rayfold("submit film", 0);
        cloud.rayfold("render film -o local%d.png", 0);
        cloud.stage.put("scripts/film/f2.txt", "Spere 1\n").await;
        cloud.stage.until("film", Status::Failed).await;
        let said = cloud.says("fetch film -o f/%d.png", 1);
        assert!(said.ends_with("f2.txt is not drawn; --partial fetches 2 other frames\n"), "{said}");
        assert!(!cloud.folder.path().join("f").exists(), "nothing to put into it");
        let said = cloud.says("fetch film -o f/%d.png --partial", 0);
        assert!(said.starts_with("f/1.png to f/3.png: 2 frames, in "), "{said}");
        assert!(said.ends_with("warning: not drawn, and not fetched: f2.txt\n"), "{said}");
        for number in [1, 3] {
            let image = |name: String| image::load_from_memory(&cloud.read(&name)).unwrap();
            assert_eq!(image(format!("f/{number}.png")), image(format!("local{number}.png")));
        }
        assert!(!cloud.folder.path().join("f/2.png").exists());
        cloud.says("fetch film -o film.gif --partial", 2);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn scripts_of_others_were_deleted_unasked() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        let bucket = cloud.stage.store().bucket().to_owned();
        cloud.write("mine/f1.txt", scene(8.0));
        cloud.write("theirs/f2.txt", scene(9.0));
        cloud.write("theirs/f3.txt", scene(9.5));
        cloud.rayfold("submit theirs --name film", 0);
        cloud.stage.until("film", Status::Done).await;
        let before = cloud.keys("").await;
        let said = cloud.says("submit mine --name film", 1);
        assert_eq!(
            said,
            format!(
                "error: there are 2 scripts in s3://{bucket}/scripts/film/ that mine does not have: f2.txt, f3.txt; \
                 nothing was uploaded: give --delete to delete them, or --name to submit another animation\n"
            )
        );
        let output = cloud.rayfold("submit mine --name film --dry-run", 0);
        let shown = String::from_utf8(output.stdout).unwrap();
        let expected = [
            "upload scripts/film/animation.json",
            "upload scripts/film/f1.txt",
            "delete scripts/film/f2.txt",
            "delete scripts/film/f3.txt",
        ];
        assert_eq!(shown.lines().collect::<Vec<_>>(), expected);
        let said = cloud.says("remove film", 1);
        assert!(said.contains("film has 3 uploaded files and ") && said.contains("nothing was removed"), "{said}");
        let shown = cloud.prints("remove film --dry-run");
        let mut listed: Vec<&str> = shown.lines().map(|line| line.strip_prefix("delete ").unwrap()).collect();
        listed.sort_unstable();
        assert_eq!(listed, before.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(cloud.keys("").await, before, "something was changed");

        cloud.rayfold("submit mine --name film --delete", 0);
        let scripts = cloud.keys("scripts/").await;
        assert_eq!(scripts, ["scripts/film/animation.json", "scripts/film/f1.txt"]);
        cloud.rayfold("remove film --delete", 0);
        cloud.stage.settle().await;
        assert!(cloud.keys("scripts/").await.is_empty());
    })
    .await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_that_takes_too_long_is_named_and_retried() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |settings| settings.timeout = Duration::from_secs(2)).await;
        let light = "Ilight .001 .001 .001 .2 -.3 -1\n";
        let sphere = "Sphere 6000 4000 4000 -9000 .2 .2 .2 .7 .6 .5\n";
        cloud.write("film/f1.txt", format!("Screen 8000 8000\n{sphere}{}Trace\n", light.repeat(1000)));
        let said = cloud.says("submit film", 1);
        assert!(
            said.contains("error: f1.txt: ") && said.contains("film is failed (0 of 1 frame, 1 failed)"),
            "{said}"
        );
        let said = cloud.says("retry film", 0);
        assert!(said.contains("film: 1 frame rendered again"), "{said}");
        cloud.stage.platform.settings_mut().timeout = Duration::from_secs(60);
        cloud.stage.restart_invoker().await;
        cloud.write("film/f1.txt", scene(8.0));
        cloud.rayfold("submit film", 0);
    })
    .await;
}

#[cfg(unix)]
#[tokio::test(flavor = "multi_thread")]
async fn an_interrupted_submission_is_picked_up() {
    on_every_store(async |store| {
        let mut cloud = cloud(store, |_| {}).await;
        cloud.stage.platform.stop_invoker().await;
        cloud.write("film/f1.txt", scene(8.0));
        cloud.write("film/f2.txt", scene(9.0));
        let mut submission = cloud.command("submit film").stderr(Stdio::piped()).spawn().unwrap();
        let start = Instant::now();
        while cloud.keys("scripts/").await.len() < 3 {
            assert!(start.elapsed() < PATIENCE, "nothing is uploaded");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        // Every script is uploaded. The command now waits, because no function draws.
        tokio::time::sleep(Duration::from_millis(500)).await;
        assert!(submission.try_wait().unwrap().is_none(), "it does not wait");
        let id = submission.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let output = submission.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        assert!(!cloud.folder.path().join("film.gif").exists());

        cloud.stage.restart_invoker().await;
        let said = cloud.says("submit film", 0);
        assert!(said.contains("up to date"), "{said}");
        cloud.rayfold("render film -o local.gif", 0);
        assert!(cloud.read("film.gif") == cloud.read("local.gif"), "the GIF is not the local one");
        assert_eq!(cloud.work().await, (2, 1));
    })
    .await;
}
