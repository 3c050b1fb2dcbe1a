//! Which renderer makes the picture.

use crate::checkpoint::Checkpoint;
use crate::choices::EngineChoice;
use crate::console::Console;
use crate::progress::Progress;
use anyhow::bail;
use splat_core::{Camera, Cloud, RenderOptions, Rendered, Unfinished};
use splat_simd::{Level, Renderer, compare};

/// A renderer, and what the statistics say of it.
#[derive(Debug)]
pub struct Engine {
    choice: EngineChoice,
    fast: Option<Renderer>,
}

impl Engine {
    /// The engine of this choice, on so many threads (`None` or 0: one a processor).
    ///
    /// # Errors
    /// If the threads cannot be made.
    pub fn new(choice: EngineChoice, threads: Option<usize>, console: Console) -> anyhow::Result<Self> {
        let fast = match choice {
            EngineChoice::Reference => None,
            EngineChoice::Fast | EngineChoice::Both => {
                Some(Renderer::new(threads.unwrap_or(0), Level::choose())?)
            }
        };
        if fast.is_none() && threads.is_some_and(|threads| threads != 1) {
            console.note("the reference engine uses one thread, whatever --threads says");
        }
        Ok(Self { choice, fast })
    }

    /// Renders a picture, with checkpoints if there are any, from where the last one was. With `both`, checks first that the two
    /// cores agree on every fragment.
    ///
    /// # Errors
    /// What the renderer says, or the first fragment in which the cores differ.
    pub fn render(
        &mut self,
        cloud: &Cloud,
        camera: &Camera,
        options: &RenderOptions,
        mut checkpoint: Option<&mut Checkpoint<'_>>,
        progress: &Progress,
        console: Console,
    ) -> anyhow::Result<Rendered> {
        let begun = checkpoint.as_ref().map(|checkpoint| checkpoint.begun(options)).transpose()?.flatten();
        let mut watch = |update: &mut dyn FnMut(f64), done: f64, unfinished: &Unfinished| {
            update(done);
            if let Some(checkpoint) = &mut checkpoint {
                checkpoint.keep(unfinished);
            }
        };
        let Some(fast) = &mut self.fast else {
            let (rendered, _) = progress.stage("render", |update| {
                let mut watch = |done, unfinished: &_| watch(update, done, unfinished);
                splat_core::render_from(begun, cloud, camera, options, &mut watch)
            });
            return Ok(rendered?);
        };
        if self.choice == EngineChoice::Both {
            let level = fast.level();
            let (compared, _) =
                progress.stage("compare", |update| compare(cloud, camera, options, level, update));
            match compared? {
                Ok(count) => console.note(format_args!("both engines agree on all {count} fragments")),
                Err(d) => bail!(
                    "the engines differ at pixel ({}, {}), sample {}, splat {}: reference {:?}, fast ({}) {:?}",
                    d.place.x,
                    d.place.y,
                    d.place.sample,
                    d.splat,
                    d.reference,
                    level.name(),
                    d.fast
                ),
            }
        }
        let (rendered, _) = progress.stage("render", |update| {
            let mut watch = |done, unfinished: &_| watch(update, done, unfinished);
            fast.render_from(begun, cloud, camera, options, &mut watch)
        });
        Ok(rendered?)
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        self.fast.as_ref().map_or(1, Renderer::threads)
    }

    /// The instruction set.
    pub fn isa(&self) -> &'static str {
        self.fast.as_ref().map_or("scalar", |fast| fast.level().name())
    }

    /// The engine's name in metadata.
    pub fn name(&self) -> &'static str {
        match self.choice {
            EngineChoice::Reference => "reference",
            EngineChoice::Fast | EngineChoice::Both => "fast",
        }
    }
}
