//! Which lines of a script a frame is made of: the line of each object that the tracer numbers, of the lights, and of
//! what is set.

use rayfold_scene::Command;

use crate::line::Line;
use crate::tables::{Role, role};

/// The lines of a frame, from 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Stage {
    /// Those of its objects, in the tracer's order.
    pub(crate) objects: Vec<usize>,
    /// Those of its lights.
    pub(crate) lights: Vec<usize>,
    /// That of its camera; none where there is only the camera that holds until one is set.
    pub(crate) camera: Option<usize>,
    /// That of its size.
    pub(crate) screen: Option<usize>,
    /// That of its background.
    pub(crate) background: Option<usize>,
    /// That of its `Trace`; where it is missing new lines go to the end.
    pub(crate) trace: Option<usize>,
}

impl Stage {
    /// The lines of frame `frame` of a script, counted from 0. Beyond the last `Trace`: what stands at the end.
    pub(crate) fn of(lines: &[Line], frame: usize) -> Self {
        let mut stage = Self::default();
        let mut traces = 0;
        for (number, line) in lines.iter().enumerate() {
            let Some(command) = line.command() else { continue };
            match (command, role(command)) {
                (Command::Clear, _) => {
                    stage.objects.clear();
                    stage.lights.clear();
                    stage.background = None;
                }
                (Command::Trace, _) => {
                    if traces == frame {
                        stage.trace = Some(number);
                        break;
                    }
                    traces += 1;
                }
                (Command::Screen, _) => stage.screen = Some(number),
                (Command::Background, _) => stage.background = Some(number),
                (_, Role::Object) => stage.objects.push(number),
                (_, Role::Light) => stage.lights.push(number),
                (_, Role::Camera) => stage.camera = Some(number),
                (_, Role::Setting) => {}
            }
        }
        stage
    }

    /// Where a new object or light of this frame goes: behind what it has, in front of its `Trace`.
    pub(crate) fn end(&self, lines: &[Line]) -> usize {
        let last = self.objects.iter().chain(&self.lights).chain(&self.camera).chain(&self.screen).max();
        match (last, self.trace) {
            (Some(last), _) => last + 1,
            (None, Some(trace)) => trace,
            (None, None) => lines.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_have_the_numbers_that_the_tracer_gives_them() {
        let text = "Screen 2 2\nSphere 1 0 0 0 0 0 0 0 0 0\n# Box\nIlight 1 1 1 1 0 0\nTrace\n\
                    box 0 0 0 1 1 1 0 0 0 0 0 0\nTrace\nClear\nOrthocamera\nSphere 1 0 0 0 0 0 0 0 0 0\nTrace\nTrace";
        let lines = Line::split(text.as_bytes());
        let script = rayfold_scene::parse("a", text.as_bytes(), &Default::default()).script.unwrap();
        let expected: [&[usize]; 4] = [&[1], &[1, 5], &[9], &[9]];
        for (frame, objects) in expected.into_iter().enumerate() {
            let stage = Stage::of(&lines, frame);
            assert_eq!(stage.objects, objects);
            assert_eq!(script.frame(frame).unwrap().objects.len(), objects.len());
        }
        let last = Stage::of(&lines, 3);
        assert_eq!(
            (last.camera, last.screen, last.lights.len(), last.trace),
            (Some(8), Some(0), 0, Some(11))
        );
        assert_eq!(last.end(&lines), 10);
    }
}
