//! `rayfold submit`: uploads a folder of scripts, and downloads the animation.
//!
//! It keeps no state: an interrupted submission continues from the contents of the bucket.

use std::path::{Path, PathBuf};

use anyhow::Context;
use rayfold_client::{
    Content, Ended, Error, File, Preview, Sending, Submission, Submitted, Waiting, settings_with_frames,
};
use rayfold_files::{named_by_scripts, probe};
use rayfold_movie::Container;
use rayfold_pipeline::keys::{Animation, ScriptName};
use rayfold_scene::{Limits, script_name};
use rayon::prelude::*;

use super::{
    BucketArgs, Client, address, agree, fetch, named, names_of, parse_animation, report, with_bucket,
};
use crate::console::{Console, visible};
use crate::input::Input;
use crate::outcome::{Outcome, Usage};
use crate::plan::{Plan, Wishes};
use crate::progress::Progress;
use crate::render::target::container_of;
use crate::values;
use crate::wording::number;

/// The maximum number of bytes of a script's name that can be drawn on MinIO and SeaweedFS. Their path segments have at
/// most 255 bytes, and that of a frame also contains the script's version.
const LONGEST_NAME: usize = 200;

/// The maximum number of bytes of the name of a script that names files: its version is longer.
const LONGEST_NAME_WITH_FILES: usize = 110;

/// Render a folder of scripts, or one script, in the cloud and download the animation
///
/// Checks all scripts, makes scripts/ANIMATION/ in the bucket equal to the folder (uploading only what changed), waits,
/// and downloads the GIF, or whatever "outputs" of its animation.json says. A script alone is a folder that holds nothing else. Scripts in the bucket that the folder does not have, somebody else's perhaps, are deleted only
/// with --delete, or after a yes at a terminal. Interrupting it loses nothing: the same command picks up where the bucket
/// is.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold submit scenes/hello --bucket my-bucket
      writes hello.gif
  rayfold submit scenes/hello --bucket my-bucket -o a.gif
      writes a.gif
  rayfold submit scenes/hello --bucket my-bucket --no-wait
      only uploads
  rayfold submit shots/7 --bucket my-bucket --name film/7
      under a name of its own
  rayfold submit scenes/hello --bucket my-bucket --dry-run
      shows what would be done")]
pub(crate) struct Args {
    /// The folder, or one script
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Where to write the animation: .gif, or .webp, .apng or .y4m if animation.json asks for it [default: all files that it
    /// asks for, under the animation's name, in the current folder]
    #[arg(long, short, value_name = "OUT", conflicts_with = "no_wait")]
    output: Option<PathBuf>,
    /// Upload and leave
    #[arg(long)]
    no_wait: bool,
    /// The animation's name in the bucket, which may hold slashes [default: the folder's name, or the script's without .txt]
    #[arg(long, value_name = "ANIMATION", value_parser = parse_animation)]
    name: Option<Animation>,
    /// Delete scripts in the bucket that the folder does not have, without asking
    #[arg(long)]
    delete: bool,
    /// Show what would be uploaded and deleted, and do nothing
    #[arg(long, conflicts_with_all = ["output", "no_wait"])]
    dry_run: bool,
    /// The largest image that a script may ask for, in pixels; the functions have a limit of their own
    #[arg(long, value_name = "N", value_parser = values::count::<u64>, allow_negative_numbers = true, default_value_t = Limits::PIXELS)]
    max_pixels: u64,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    let limits = Limits { max_pixels: args.max_pixels, ..Limits::default() };
    let is_fetched = !args.no_wait && !args.dry_run;
    let order =
        Order::new(&args.folder, args.name.as_ref(), args.output.as_deref(), is_fetched, &limits, console)?;
    with_bucket(&args.bucket, async |client| {
        let bucket = &args.bucket.bucket;
        let Order { animation, mut submission, outputs } = order;
        if args.dry_run {
            return preview(client, &submission, bucket, console).await;
        }
        if args.delete {
            submission = submission.deleting_all_others();
        }
        let submitted = loop {
            match send(client, &submission, bucket, console).await {
                Err(Error::WouldDelete { keys }) => {
                    may_delete(args, &submission, &keys, console).await?;
                    submission = submission.deleting(keys);
                }
                submitted => break submitted?,
            }
        };
        if args.no_wait {
            console.note(format_args!(
                "{animation} is under way; rayfold status {animation} --bucket {bucket} --watch follows it"
            ));
            return Ok(Outcome::Done);
        }
        if let Some(why) = wait(client, &animation, &submitted, console).await? {
            anyhow::bail!("{why}; rayfold retry {animation} tries again what is not the scripts' fault");
        }
        for (container, path) in &outputs {
            fetch::file(client, &animation, (*container, path), &args.bucket, console).await?;
        }
        Ok(Outcome::Done)
    })
}

/// A folder that is to become an animation in a bucket, read and checked.
pub(crate) struct Order {
    animation: Animation,
    submission: Submission,
    /// The files to write.
    outputs: Vec<(Container, PathBuf)>,
}

impl Order {
    /// Makes an order. The default name is that of the folder. By default the outputs are all that the settings ask
    /// for, under that name. If outputs are fetched, it checks that they can be written.
    ///
    /// # Errors
    /// Fails if a script is faulty, the frames have different sizes, the settings do not ask for the output, or it
    /// cannot be written there.
    pub(crate) fn new(
        folder: &PathBuf,
        name: Option<&Animation>,
        output: Option<&Path>,
        is_fetched: bool,
        limits: &Limits,
        console: &Console,
    ) -> anyhow::Result<Self> {
        let animation = name.cloned().map_or_else(|| name_of(folder), Ok)?;
        let last = animation.as_str().rsplit('/').next().unwrap_or_default();
        let output = output.map(|path| Ok::<_, Usage>((container_of(path)?, path))).transpose()?;
        let input = Input::animation(std::slice::from_ref(folder), limits)?;
        let plan = match Plan::new(&input, limits, &Wishes::default(), console)? {
            Ok(plan) => plan,
            Err(faults) => anyhow::bail!("nothing was uploaded: {}", faults.count()),
        };
        plan.one_size().map_err(|error| anyhow::anyhow!("{error}: give their scripts the same Screen"))?;
        let asked_for = plan.settings.outputs();
        let outputs: Vec<(Container, PathBuf)> = match output {
            Some((container, path)) if asked_for.contains(&container) => {
                vec![(container, path.to_path_buf())]
            }
            Some((container, _)) => {
                anyhow::bail!("nothing was uploaded: {}", fetch::not_asked_for(asked_for, container, last))
            }
            None => {
                let path = |output: &Container| (*output, format!("{last}.{}", output.ending()).into());
                asked_for.iter().map(path).collect()
            }
        };
        for (_, path) in outputs.iter().filter(|_| is_fetched) {
            probe(path)?;
        }
        let submission = submission(&input, &plan, &animation, console)?;
        Ok(Self { animation, submission, outputs })
    }

    /// Uploads the animation to an empty bucket, waits, and downloads the files.
    ///
    /// # Errors
    /// Fails if there are no files, or the bucket cannot be used.
    pub(crate) async fn deliver(
        &self,
        client: Client<'_>,
        bucket: &BucketArgs,
        console: &Console,
    ) -> anyhow::Result<()> {
        let submitted = send(client, &self.submission, &bucket.bucket, console).await?;
        if let Some(why) = wait(client, &self.animation, &submitted, console).await? {
            anyhow::bail!("{why}");
        }
        for (container, path) in &self.outputs {
            fetch::file(client, &self.animation, (*container, path), bucket, console).await?;
        }
        Ok(())
    }
}

fn name_of(folder: &Path) -> anyhow::Result<Animation> {
    let place = folder.canonicalize().with_context(|| format!("cannot read {}", folder.display()))?;
    let name = if place.is_dir() { place.file_name() } else { place.file_stem() };
    let name = name.and_then(|name| name.to_str());
    let name = name.ok_or_else(|| Usage(format!("{} has no name to use: give --name", folder.display())))?;
    Ok(Animation::new(name)?)
}

/// Returns the contents that the bucket's folder should have.
fn submission(
    input: &Input,
    plan: &Plan,
    animation: &Animation,
    console: &Console,
) -> anyhow::Result<Submission> {
    // What a model refers to may be absent.
    let files = named_by_scripts().into_iter().filter(|path| path.is_file()).map(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, File::new(Content::Path(path))?))
    });
    let files: Vec<(String, File)> = files.collect::<rayfold_client::Result<_>>()?;
    let longest = if files.is_empty() { LONGEST_NAME } else { LONGEST_NAME_WITH_FILES };
    let mut scripts = Vec::new();
    for path in input.scripts.iter().filter_map(|script| script.path()) {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.with_context(|| format!("the name of {} is not UTF-8", path.display()))?;
        let name = ScriptName::new(script_name(name).unwrap_or(name))?;
        if name.as_str().len() > longest {
            console.note(format_args!(
                "{name}.txt: on S3 it is drawn; on MinIO and SeaweedFS, whose path segments have at most 255 bytes, a name of \
                 more than {longest} bytes is too long for its frame"
            ));
        }
        scripts.push((name, path.to_path_buf()));
    }
    let settings = match (&input.settings, plan.settings.frames()) {
        (Some(path), Some(_)) => File::new(Content::Path(path.clone()))?,
        _ => settings_with_frames(&plan.settings, plan.len())?,
    };
    let scripts = scripts.into_par_iter().map(|(name, path)| Ok((name, File::new(Content::Path(path))?)));
    let scripts: Vec<(ScriptName, File)> = scripts.collect::<rayfold_client::Result<_>>()?;
    Ok(Submission::new(animation.clone(), scripts, settings)?.with_files(files)?)
}

/// Shows the uploads and deletions that a submission would make, one line per file.
async fn preview(
    client: Client<'_>,
    submission: &Submission,
    bucket: &str,
    console: &Console,
) -> anyhow::Result<Outcome> {
    let Preview { upload, delete, unchanged } = client.preview(submission).await?;
    let lines = |what: &'static str, keys: &[String]| {
        keys.iter().map(|key| format!("{what} {}\n", visible(key))).collect::<String>()
    };
    console.print(lines("upload", &upload) + &lines("delete", &delete))?;
    console.note(format_args!(
        "{}: {} would be uploaded, {} deleted, {unchanged} unchanged",
        address(bucket, &submission.animation().scripts()),
        number(upload.len() as u64, "file"),
        delete.len()
    ));
    Ok(Outcome::Done)
}

/// Asks whether scripts that the folder does not have may be deleted.
///
/// # Errors
/// Fails if they may not be deleted, or there is no user to ask.
async fn may_delete(
    args: &Args,
    submission: &Submission,
    keys: &[String],
    console: &Console,
) -> anyhow::Result<()> {
    let (animation, shown) = (submission.animation(), args.folder.display());
    let names = names_of(keys, &animation.scripts());
    let what = format!(
        "{} in {} that {shown} does not have",
        number(keys.len() as u64, "script"),
        address(&args.bucket.bucket, &animation.scripts())
    );
    match agree(&names, &format!("Delete {what}?"), console).await? {
        Some(true) => Ok(()),
        Some(false) => anyhow::bail!("nothing was uploaded"),
        None => anyhow::bail!(
            "there are {what}: {}; nothing was uploaded: give --delete to delete them, or --name to submit another \
             animation",
            named(&names)
        ),
    }
}

/// Makes the bucket's folder equal to the submission, and shows the progress.
async fn send(
    client: Client<'_>,
    submission: &Submission,
    bucket: &str,
    console: &Console,
) -> rayfold_client::Result<Submitted> {
    let folder = address(bucket, &submission.animation().scripts());
    let mut progress: Option<Progress> = None;
    let show = |sending| match sending {
        Sending::Deleted { scripts } => {
            console
                .note(format_args!("{} that the folder does not have: deleted", number(scripts, "script")));
        }
        Sending::Uploading { done, total } => {
            let bar = progress.get_or_insert_with(|| Progress::start(console, "files uploaded", total));
            bar.set(console, done);
        }
        Sending::Finished { uploaded, unchanged } => match progress.take() {
            None => console.note(format_args!("{folder} up to date")),
            Some(progress) => {
                let took = progress.finish().as_secs_f64();
                console.note(format_args!(
                    "{folder}: {} uploaded in {took:.2} s, {unchanged} unchanged",
                    number(uploaded, "file")
                ));
            }
        },
    };
    client.submit(submission, show).await
}

/// Waits until the files of the uploaded scripts are made or cannot be made, and shows the progress. Returns the reason
/// if there are no files.
async fn wait(
    client: Client<'_>,
    animation: &Animation,
    submitted: &Submitted,
    console: &Console,
) -> anyhow::Result<Option<String>> {
    let mut progress: Option<Progress> = None;
    let show = |waiting| match waiting {
        Waiting::Frames { done, total } => {
            let bar = progress.get_or_insert_with(|| Progress::start(console, "frames", total));
            bar.resize(total);
            bar.set(console, done);
        }
        Waiting::Quiet(quiet) => console.note(format_args!(
            "nothing has happened for {} s: are the functions running? Ctrl-C loses nothing",
            quiet.as_secs()
        )),
    };
    let Ended::Failed(manifest) = client.wait(animation, submitted, show).await? else { return Ok(None) };
    report::show_faults(&manifest, console);
    Ok(Some(format!("{animation} is {} ({})", manifest.head.status, report::count(&manifest))))
}
