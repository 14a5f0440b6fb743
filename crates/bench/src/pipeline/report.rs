//! The page: our seconds next to the paper's, and where they go.

use std::fmt::Write as _;

use anyhow::Result;
use rayfold_local::StoreKind;
use rayfold_local::routes::Function;

use super::{AT_ONCE, Run, Scene};

pub(super) fn text(store: StoreKind, scenes: &[Scene], load: &str, plot: &str) -> Result<String> {
    let mut page = String::new();
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (flag, other, of_store) = match store {
        StoreKind::BuiltIn => ("", " ([on MinIO](pipeline-minio.md))", "The store"),
        StoreKind::Minio => (" --store minio", " ([on the store built in](pipeline.md))", "MinIO"),
    };
    writeln!(
        page,
        "# Pipeline on {store}\n\n\
         Written by `cargo run --release -p rayfold-bench -- pipeline{flag}`{other}; all figures are of one run, on \
         {threads} processors and with a load of {load} (`/proc/loadavg`) when it began: what else runs on the machine \
         counts in every time below.\n\n\
         {of_store}, the local invoker, the uploads and the functions share the machine. The paper's seconds are of its \
         figure 4: up to ten ray tracers on machines of their own, images of 1024 x 1024, another renderer; our scenes \
         are drawn after its names, object counts and frame counts, so the rows can be read side by side, not divided.\n\n\
         ## Seconds from the first upload to the GIF\n\n\
         *Cloud*: the assemble function makes the GIF; *local*: frames are fetched and compiled by the client (both \
         with warm processes); *cold*: as cloud, each process started for it. *Sequential*: every frame drawn on one \
         thread, one after the other, without a GIF.\n"
    )?;
    let mut head = "| scene | objects | frames |".to_owned();
    for at_once in AT_ONCE {
        write!(head, " {at_once}: local | paper | {at_once}: cloud | paper | {at_once}: cold |")?;
    }
    writeln!(page, "{head} sequential | paper |")?;
    writeln!(page, "|{}", " --- |".repeat(head.matches('|').count() + 1))?;
    for scene in scenes {
        write!(
            page,
            "| {} | {:.0} | {} |",
            scene.folder.name,
            scene.folder.objects(),
            scene.folder.frames()
        )?;
        for (place, runs) in scene.runs.iter().enumerate() {
            let paper = [scene.paper[place * 2], scene.paper[place * 2 + 1]].map(seconds_of_paper);
            let [local, cloud, cold] =
                [&runs.local, &runs.warm, &runs.cold].map(|run| format!("{:.2}", run.total.as_secs_f64()));
            write!(page, " {local} | {} | {cloud} | {} | {cold} |", paper[0], paper[1])?;
        }
        writeln!(page, " {:.2} | {} |", scene.sequential.as_secs_f64(), seconds_of_paper(scene.paper[4]))?;
    }
    writeln!(
        page,
        "\n## Where a frame's time goes\n\n\
         Means over the frames, in milliseconds, as the render function logs them; *GIF* is the building of the whole \
         GIF, *after upload* the seconds from the last upload to the GIF.\n\n\
         | scene | at once | run | read | draw | put | fold | GIF | after upload |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    each(scenes, |scene, at_once, label, run| {
        let [read, draw, put, fold] = run.stages;
        let (gif, after) = (run.building.as_millis(), run.after_upload.as_secs_f64());
        writeln!(
            page,
            "| {scene} | {at_once} | {label} | {read:.1} | {draw:.1} | {put:.1} | {fold:.1} | {gif} | {after:.2} |"
        )
        .map_err(Into::into)
    })?;
    writeln!(
        page,
        "\n## Requests a frame, and cold starts\n\n\
         Counted between each process and the store. *Billed* is what S3 charges for (all but DELETE), of both \
         functions together, the assembler's reading of each frame included.\n\n\
         | scene | at once | run | render: GET | PUT | LIST | assemble: GET | PUT | LIST | billed a frame | cold starts \
         | mean ms to the first `next` |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    )?;
    each(scenes, |scene, at_once, label, run| {
        let frames = scenes.iter().find(|s| s.folder.name == scene).map_or(1, |s| s.folder.frames()) as f64;
        let of = |function| run.requests.get(&function).copied().unwrap_or_default();
        let (render, assemble) = (of(Function::Render), of(Function::Assemble));
        let billed = (render.billed() + assemble.billed()) as f64 / frames;
        let cells = [render.get, render.put, render.list, assemble.get, assemble.put, assemble.list]
            .map(|count| format!("{:.2}", count as f64 / frames))
            .join(" | ");
        let (starts, init) = (run.cold_starts, run.init.as_secs_f64() * 1e3);
        writeln!(page, "| {scene} | {at_once} | {label} | {cells} | {billed:.2} | {starts} | {init:.1} |")
            .map_err(Into::into)
    })?;
    writeln!(page, "\n## Who worked when\n\n![a row a process, a bar an invocation]({plot})")?;
    writeln!(page, "\nBlue is the render function, orange the assemble function.")?;
    Ok(page)
}

fn each(scenes: &[Scene], mut row: impl FnMut(&str, usize, &str, &Run) -> Result<()>) -> Result<()> {
    for scene in scenes {
        for (runs, at_once) in scene.runs.iter().zip(AT_ONCE) {
            for (label, run) in [("cold", &runs.cold), ("warm", &runs.warm), ("local", &runs.local)] {
                row(&scene.folder.name, at_once, label, run)?;
            }
        }
    }
    Ok(())
}

fn seconds_of_paper(seconds: Option<f64>) -> String {
    seconds.map_or("timeout".to_owned(), |seconds| format!("{seconds:.2}"))
}
