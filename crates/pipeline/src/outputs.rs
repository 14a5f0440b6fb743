//! The files that are made of an animation: those that exist, and those that must be made or deleted.
//!
//! Each round checks the GIF, because there may always be one. Another file is checked if the settings ask for it, or
//! if there is a mark: an object below `frames/` that an assembler puts before the first such file. A mark stays as
//! long as the animation, because a file may appear after its assembler has died.

use std::collections::{BTreeMap, BTreeSet};

use rayfold_scene::Container;

use crate::build::is_current;
use crate::invocation::{Invocation, Known};
use crate::keys::Animation;
use crate::manifest::{Head, Status};
use crate::observe::Observation;
use crate::store::{ETag, ObjectInfo, Store};
use crate::{Clock, Result};

/// The files of an animation, as far as they were checked.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Outputs(BTreeMap<Container, Option<ObjectInfo>>);

/// The next action for the files of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Due {
    /// The files are as they should be, or frames are still to come.
    Nothing,
    /// This file must be made.
    File(Container),
    /// This file must be deleted.
    NoFile(Container),
}

/// Returns the files to check, according to a manifest and a listing.
pub(crate) fn needed(known: Option<&Known>, observation: Option<&Observation>) -> BTreeSet<Container> {
    let observed = observation.map(|observation| &observation.manifest.head);
    let heads = known.map(|known| &known.manifest.head).into_iter().chain(observed);
    let wanted = heads.flat_map(Head::outputs);
    let marked = observation.iter().flat_map(|observation| &observation.marked);
    [Container::Gif].iter().chain(wanted).chain(marked).copied().collect()
}

impl Outputs {
    /// Returns whether all these were looked at.
    pub(crate) fn covers(&self, needed: &BTreeSet<Container>) -> bool {
        needed.iter().all(|output| self.0.contains_key(output))
    }

    /// Returns the kinds that were looked at.
    pub(crate) fn looked_at(&self) -> BTreeSet<Container> {
        self.0.keys().copied().collect()
    }

    /// Returns the file of a kind, if there is one.
    pub(crate) fn get(&self, output: Container) -> Option<&ObjectInfo> {
        self.0.get(&output)?.as_ref()
    }

    /// Returns the kinds of the existing files.
    pub(crate) fn existing(&self) -> impl Iterator<Item = Container> {
        self.0.iter().filter(|(_, file)| file.is_some()).map(|(output, _)| *output)
    }

    /// Returns the next action for the set in the manifest's head.
    pub(crate) fn due(&self, head: &Head) -> Due {
        let wanted = head.outputs();
        let due = match head.status {
            Status::Done => {
                let missing = wanted.iter().find(|output| !is_current(head, **output, self.get(**output)));
                let extra = || self.existing().find(|output| !wanted.contains(output));
                missing.map(|output| Due::File(*output)).or_else(|| extra().map(Due::NoFile))
            }
            Status::Empty | Status::Failed | Status::Refused => self.existing().next().map(Due::NoFile),
            // While more is to come the last files stay.
            Status::Waiting | Status::Rendering => None,
        };
        due.unwrap_or(Due::Nothing)
    }

    /// Returns the versions of this set's files that the manifest does not record yet.
    pub(crate) fn unrecorded(&self, head: &Head) -> Vec<(Container, ETag)> {
        let new = |output: &Container| {
            let file = self.get(*output)?;
            let is_new = head.version_of(*output).is_none() && is_current(head, *output, Some(file));
            is_new.then(|| (*output, file.etag.clone()))
        };
        let wanted = head.outputs().iter().filter(|_| head.status == Status::Done);
        wanted.filter_map(new).collect()
    }

    /// Returns whether both show the same versions of the same files.
    pub(crate) fn are(&self, other: &Outputs) -> bool {
        let etags = |outputs: &Outputs| -> BTreeMap<Container, Option<ETag>> {
            let etag = |file: &Option<ObjectInfo>| file.as_ref().map(|file| file.etag.clone());
            outputs.0.iter().map(|(output, file)| (*output, etag(file))).collect()
        };
        etags(self) == etags(other)
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    /// Checks those of these files that were not checked yet.
    pub(crate) async fn look_at_outputs(
        &self,
        animation: &Animation,
        needed: &BTreeSet<Container>,
        outputs: &mut Outputs,
    ) -> Result<()> {
        for output in needed {
            if !outputs.0.contains_key(output) {
                let file = self.head(&animation.output(*output)).await?;
                outputs.0.insert(*output, file);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use rayfold_scene::AnimationSettings;

    use super::*;
    use crate::Timestamp;
    use crate::build::GENERATION;
    use crate::manifest::{Made, Settings};
    use crate::reconcile::{Results, Scripts, reconcile};
    use crate::store::Metadata;

    fn head(status: Status, outputs: &[Container]) -> Head {
        let animation = Animation::new("film").unwrap();
        let value = AnimationSettings::default().with_outputs(outputs.to_vec()).ok();
        let settings = Settings { version: None, value, fault: None };
        let manifest = reconcile(&animation, &Scripts::default(), &Results::default(), &settings);
        Head { status, total: 9, ..manifest.head }
    }

    fn file(generation: Option<&str>) -> ObjectInfo {
        let metadata = generation.map(|generation| (GENERATION.to_owned(), generation.to_owned()));
        let metadata: Metadata = metadata.into_iter().collect();
        ObjectInfo { etag: ETag::new("e"), size: 1, modified: Timestamp(0), metadata }
    }

    const GIF: Container = Container::Gif;
    const WEBP: Container = Container::Webp;

    #[test]
    fn what_is_due_follows_from_the_status_and_the_generation_of_the_gif() {
        let current = file(Some(head(Status::Done, &[GIF]).generation.as_str()));
        let older = file(Some("another"));
        let unknown = file(None);
        let (make, remove) = (Due::File(GIF), Due::NoFile(GIF));
        for (status, expected) in [
            (Status::Done, [make, Due::Nothing, make, make]),
            (Status::Empty, [Due::Nothing, remove, remove, remove]),
            (Status::Failed, [Due::Nothing, remove, remove, remove]),
            (Status::Refused, [Due::Nothing, remove, remove, remove]),
            (Status::Waiting, [Due::Nothing; 4]),
            (Status::Rendering, [Due::Nothing; 4]),
        ] {
            let gifs = [None, Some(&current), Some(&older), Some(&unknown)];
            let due =
                |gif: Option<&ObjectInfo>| Outputs([(GIF, gif.cloned())].into()).due(&head(status, &[GIF]));
            assert_eq!(gifs.map(due), expected, "{status:?}");
        }
    }

    /// Files are handled in the order of the settings. Files that the settings do not name are deleted last.
    #[test]
    fn all_files_that_are_asked_for_are_made_and_no_others_stay() {
        let current = file(Some(head(Status::Done, &[GIF]).generation.as_str()));
        let files = |there: &[Container]| {
            Outputs(
                [GIF, WEBP].map(|output| (output, there.contains(&output).then(|| current.clone()))).into(),
            )
        };
        for (wanted, there, expected) in [
            (&[GIF, WEBP][..], &[][..], Due::File(GIF)),
            (&[WEBP, GIF], &[], Due::File(WEBP)),
            (&[GIF, WEBP], &[GIF], Due::File(WEBP)),
            (&[GIF, WEBP], &[GIF, WEBP], Due::Nothing),
            (&[WEBP], &[GIF], Due::File(WEBP)),
            (&[WEBP], &[GIF, WEBP], Due::NoFile(GIF)),
            (&[GIF], &[GIF, WEBP], Due::NoFile(WEBP)),
        ] {
            assert_eq!(files(there).due(&head(Status::Done, wanted)), expected, "{wanted:?} {there:?}");
        }
        assert_eq!(files(&[WEBP]).due(&head(Status::Failed, &[GIF])), Due::NoFile(WEBP));
        assert!(files(&[]).covers(&[GIF].into()) && !files(&[]).covers(&[GIF, Container::Apng].into()));
        assert!(files(&[GIF]).are(&files(&[GIF])) && !files(&[GIF]).are(&files(&[WEBP])));
    }

    /// A file is not recorded if it belongs to another set, is recorded already, or its set is not complete.
    #[test]
    fn a_file_is_new_that_is_of_this_set_and_not_written_down() {
        let generation = head(Status::Done, &[GIF]).generation;
        let this = file(Some(generation.as_str()));
        let named =
            |version: &str| Some(Made { generation: generation.clone(), version: ETag::new(version) });
        let other = file(Some("another"));
        for (status, named, gif, expected) in [
            (Status::Done, None, Some(&this), Some(ETag::new("e"))),
            (Status::Done, None, None, None),
            (Status::Done, None, Some(&other), None),
            (Status::Done, named("e"), Some(&this), None),
            (Status::Done, named("f"), Some(&this), None),
            (Status::Rendering, None, Some(&this), None),
        ] {
            let head = Head { gif: named, ..head(status, &[GIF]) };
            let files = Outputs([(GIF, gif.cloned())].into());
            let expected: Vec<_> = expected.into_iter().map(|etag| (GIF, etag)).collect();
            assert_eq!(files.unrecorded(&head), expected, "{status:?} {head:?}");
        }
        let mut both = head(Status::Done, &[GIF, WEBP]);
        let files = Outputs([(GIF, Some(this.clone())), (WEBP, Some(this))].into());
        assert_eq!(files.unrecorded(&both).len(), 2);
        both.record(WEBP, ETag::new("e"));
        assert_eq!(files.unrecorded(&both), [(GIF, ETag::new("e"))]);
        both.record(GIF, ETag::new("e"));
        assert_eq!(files.unrecorded(&both), []);
    }
}
