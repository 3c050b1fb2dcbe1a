//! What happens when somebody stops the program: Ctrl-C, or a request to terminate.

/// Sees to it that a stopped program leaves no half-made file, and ends at once: with exit code 130 on SIGINT, 143 on
/// SIGTERM. Elsewhere than on Unix the system's own way stands.
///
/// # Errors
/// If the system lets nobody watch for signals.
#[cfg(unix)]
pub fn watch() -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        if let Some(signal) = signals.forever().next() {
            splat_io::atomic::abandon_all();
            crate::console::to_stderr("interrupted");
            std::process::exit(128 + signal);
        }
    })?;
    Ok(())
}

/// See above.
#[cfg(not(unix))]
pub fn watch() -> std::io::Result<()> {
    Ok(())
}
