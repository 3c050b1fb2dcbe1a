//! `--shading edl`: a picture, shaded by its own depths.

use crate::checkpoint::Checkpoint;
use crate::console::Console;
use crate::engine::Engine;
use crate::progress::Progress;
use splat_core::{AovSelection, Camera, Cloud, RenderOptions, Rendered, eye_dome};

/// Renders a picture and shades it. What is asked for is rendered with a margin, so that a crop is a part of the whole, and
/// without its background, which stays as it is.
///
/// # Errors
/// What the renderer says.
pub fn render(
    engine: &mut Engine,
    cloud: &Cloud,
    camera: &Camera,
    options: &RenderOptions,
    strength: f64,
    checkpoint: Option<&mut Checkpoint<'_>>,
    progress: &Progress,
    console: Console,
) -> anyhow::Result<Rendered> {
    let frame = [camera.width, camera.height];
    let with_depth = RenderOptions {
        window: options.window.map(|window| eye_dome::with_margin(window, frame)),
        background: None,
        // The part that is asked for is cut out of what has the margin.
        memory: if options.memory == usize::MAX { usize::MAX } else { options.memory / 2 },
        aovs: AovSelection { depth: true, ..options.aovs },
        ..options.clone()
    };
    let mut rendered = engine.render(cloud, camera, &with_depth, checkpoint, progress, console)?;
    eye_dome::shade(&mut rendered.film, camera, strength)?;
    if let Some(window) = options.window {
        rendered.film = rendered.film.part(window);
    }
    if !options.aovs.depth {
        rendered.film.depth = None;
    }
    if let Some(background) = options.background {
        rendered.film.put_behind(background);
    }
    Ok(rendered)
}
