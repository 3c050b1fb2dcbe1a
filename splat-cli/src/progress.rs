//! Progress of the stages: a bar on a terminal, or lines of JSON.

use crate::choices::ProgressChoice;
use crate::console;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::time::{Duration, Instant};

/// How progress is shown.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    choice: ProgressChoice,
    frame: Option<Frame>,
}

/// One of several pictures.
#[derive(Debug, Clone, Copy, Serialize)]
struct Frame {
    /// Counted from 1.
    frame: usize,
    frames: usize,
}

/// A line of JSON.
#[derive(Debug, Serialize)]
struct Line {
    stage: &'static str,
    done: f64,
    #[serde(flatten)]
    frame: Option<Frame>,
}

/// Steps of a bar; JSON has as many lines a stage.
const STEPS: f64 = 100.0;

impl Progress {
    /// Shows progress as chosen; a quiet program has no bar.
    pub fn new(choice: ProgressChoice, is_quiet: bool) -> Self {
        let is_none = is_quiet && choice == ProgressChoice::Auto;
        Self { choice: if is_none { ProgressChoice::None } else { choice }, frame: None }
    }

    /// The same, said to be of one of several pictures, counted from 1.
    pub fn frame(self, frame: usize, frames: usize) -> Self {
        Self { frame: (frames > 1).then_some(Frame { frame, frames }), ..self }
    }

    /// Does the work of a stage. It tells its progress, from 0 to 1, to the function that it is given.
    /// Returns its result and the time that it took.
    pub fn stage<T>(self, stage: &'static str, work: impl FnOnce(&mut dyn FnMut(f64)) -> T) -> (T, Duration) {
        let start = Instant::now();
        let result = match self.choice {
            ProgressChoice::None => work(&mut |_| {}),
            ProgressChoice::Json => with_lines(stage, self.frame, work, &mut |line| console::to_stderr(line)),
            ProgressChoice::Auto => with_bar(stage, self.frame, work),
        };
        (result, start.elapsed())
    }
}

/// Does the work under a bar, which is not drawn where stderr is no terminal.
fn with_bar<T>(stage: &'static str, frame: Option<Frame>, work: impl FnOnce(&mut dyn FnMut(f64)) -> T) -> T {
    let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::stderr());
    let style = ProgressStyle::with_template("{spinner} {msg:8} {wide_bar} {percent:>3} % {elapsed:>4}");
    bar.set_style(style.expect("the template is well formed"));
    bar.set_message(match frame {
        Some(Frame { frame, frames }) => format!("{stage} {frame} of {frames}"),
        None => stage.to_owned(),
    });
    bar.enable_steady_tick(Duration::from_millis(100));
    let result = work(&mut |done| bar.set_position((STEPS * done) as u64));
    bar.finish_and_clear();
    result
}

/// Does the work and writes a line at its start, at its end, and for each hundredth between.
fn with_lines<T>(
    stage: &'static str,
    frame: Option<Frame>,
    work: impl FnOnce(&mut dyn FnMut(f64)) -> T,
    write: &mut dyn FnMut(&str),
) -> T {
    let mut last = None;
    let mut update = |done: f64| {
        let step = (STEPS * done.clamp(0.0, 1.0)) as u64;
        if last.is_none_or(|last| step > last) {
            last = Some(step);
            let line = serde_json::to_string(&Line { stage, done: step as f64 / STEPS, frame });
            write(&line.expect("a name and a number are valid JSON"));
        }
    };
    update(0.0);
    let result = work(&mut update);
    update(1.0);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_json_a_hundredth() {
        let mut lines = Vec::new();
        let work = |update: &mut dyn FnMut(f64)| {
            for done in [0.0, 0.001, 0.25, 0.252, 0.2, 0.5] {
                update(done);
            }
            7
        };
        assert_eq!(with_lines("render", None, work, &mut |line| lines.push(line.to_owned())), 7);
        let expected = [0.0, 0.25, 0.5, 1.0].map(|done| format!(r#"{{"stage":"render","done":{done:?}}}"#));
        assert_eq!(lines, expected);
        let frame = Progress::new(ProgressChoice::Json, false).frame(2, 9).frame;
        with_lines("write", frame, |_| (), &mut |line| lines.push(line.to_owned()));
        assert_eq!(lines.last().unwrap(), r#"{"stage":"write","done":1.0,"frame":2,"frames":9}"#);
    }

    #[test]
    fn a_quiet_program_has_no_bar_but_the_lines_that_were_asked_for() {
        assert_eq!(Progress::new(ProgressChoice::Auto, true).choice, ProgressChoice::None);
        assert_eq!(Progress::new(ProgressChoice::Json, true).choice, ProgressChoice::Json);
        assert_eq!(Progress::new(ProgressChoice::Auto, false).choice, ProgressChoice::Auto);
    }
}
