//! The subcommands that use a bucket, run under the policy of each kind of user in the document that Terraform prints.
//! Each kind can do everything that its description promises, and denied operations change nothing.

use std::path::Path;
use std::process::{Command, Stdio};

use super::stage::role::environment;
use super::stage::stores::on_every_store_with_roles;
use super::stage::{Stage, functions_beside, scene};
use rayfold_pipeline::manifest::Status;
use rayfold_pipeline::store::{ListRequest, Store};

const RAYFOLD: &str = env!("CARGO_BIN_EXE_rayfold");

/// A user of a kind, with access to a bucket and a folder.
struct User<'a> {
    stage: &'a Stage,
    name: &'static str,
    credentials: Vec<(String, String)>,
    folder: tempfile::TempDir,
}

impl<'a> User<'a> {
    async fn new(stage: &'a Stage, name: &'static str) -> Self {
        let credentials = environment(stage.platform.server(), name, stage.store().bucket()).await;
        Self { stage, name, credentials, folder: tempfile::tempdir().unwrap() }
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    /// Returns whether the command succeeds, and its output.
    fn try_to(&self, args: &str) -> (bool, String) {
        let output = Command::new(RAYFOLD)
            .args(args.split_whitespace())
            .current_dir(self.folder.path())
            .envs(self.stage.platform.server().environment())
            .envs(self.credentials.iter().cloned())
            .env("RAYFOLD_BUCKET", self.stage.store().bucket())
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        (output.status.success(), said)
    }

    fn can(&self, args: &str) -> String {
        let (done, said) = self.try_to(args);
        assert!(done, "{} must be able to: rayfold {args}: {said}", self.name);
        said
    }

    fn cannot(&self, args: &str) {
        let (done, said) = self.try_to(args);
        assert!(!done, "{} must not be able to: rayfold {args}: {said}", self.name);
        let denied = ["AccessDenied", "Access Denied", "403", "denied"];
        assert!(denied.iter().any(|word| said.contains(word)), "{}: rayfold {args}: {said}", self.name);
    }
}

/// Returns every object with its version.
async fn objects(stage: &Stage) -> Vec<(String, String)> {
    let page = stage.store().list(ListRequest::all("")).await.unwrap();
    page.objects.into_iter().map(|object| (object.key, object.etag.as_str().to_owned())).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn each_kind_of_user_can_do_what_its_name_says_and_no_more() {
    on_every_store_with_roles(async |store| {
        let mut stage = super::stage::stage(store, functions_beside(Path::new(RAYFOLD)), |_| {}).await;
        {
            let uploader = User::new(&stage, "uploader").await;
            uploader.write("film/f1.txt", &scene(8.0));
            uploader.write("film/f2.txt", &scene(9.0));
            uploader.can("submit film -o first.gif");
            // The sizes are equal, so only the object itself shows whether it has changed.
            uploader.write("film/f2.txt", &scene(7.0));
            let said = uploader.can("submit film -o second.gif");
            assert!(said.contains("1 file uploaded"), "{said}");
            uploader.can("status");
            uploader.can("status film");
            uploader.can("fetch film -o again.gif");
            let file = |name: &str| std::fs::read(uploader.folder.path().join(name)).unwrap();
            assert_eq!(file("again.gif"), file("second.gif"));
            assert_ne!(file("again.gif"), file("first.gif"));
        }
        stage.until("film", Status::Done).await;

        let before = objects(&stage).await;
        {
            let uploader = User::new(&stage, "uploader").await;
            uploader.cannot("retry film --all");
            uploader.cannot("remove film --delete");
            let viewer = User::new(&stage, "viewer").await;
            assert!(viewer.can("status").contains("film"));
            viewer.can("status film");
            viewer.can("fetch film -o film.gif");
            viewer.can("fetch film -o %02d.png");
            assert!(viewer.folder.path().join("02.png").exists());
            viewer.write("film/f1.txt", &scene(5.0));
            viewer.write("film/f2.txt", &scene(7.0));
            viewer.cannot("submit film");
            viewer.cannot("retry film --all");
            viewer.cannot("remove film --delete");
        }
        stage.settle().await;
        assert_eq!(objects(&stage).await, before, "what was denied has changed something");

        {
            let operator = User::new(&stage, "operator").await;
            operator.write("film/f1.txt", &scene(8.0));
            operator.write("film/f2.txt", &scene(6.0));
            operator.can("submit film -o film.gif");
            operator.can("status film");
            operator.can("fetch film -o again.gif");
            let said = operator.can("retry film --all");
            assert!(said.contains("2 frames rendered again"), "{said}");
        }
        stage.until("film", Status::Done).await;
        {
            let operator = User::new(&stage, "operator").await;
            operator.can("remove film --delete");
        }
        stage.settle().await;
        let left: Vec<_> = objects(&stage).await.into_iter().map(|(key, _)| key).collect();
        assert!(left.iter().all(|key| !key.starts_with("scripts/")), "{left:?}");
    })
    .await;
}
