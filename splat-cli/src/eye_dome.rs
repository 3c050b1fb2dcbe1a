//! `--shading edl`: a picture, shaded by its own depths.

use splat_core::{AovSelection, Camera, RenderOptions, Rendered, eye_dome};

/// Renders a picture, by `render` with other options, and shades it. What is asked for is rendered with a margin, so that a crop is
/// a part of the whole, and without its background, which stays as it is.
///
/// # Errors
/// What the renderer says.
pub fn render(
    camera: &Camera,
    options: &RenderOptions,
    strength: f64,
    render: impl FnOnce(&RenderOptions) -> anyhow::Result<Rendered>,
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
    let mut rendered = render(&with_depth)?;
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
