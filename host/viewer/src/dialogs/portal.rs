//! Whether the desktop has file dialogs. Where it has none, opening one looks as if the user had
//! cancelled.

/// Returns an error if there are none. May wait for the desktop, so it must not run on the window's
/// thread.
pub(super) fn check_desktop() -> Result<(), String> {
    #[cfg(all(unix, not(target_os = "macos")))]
    {
        bus::check_desktop()
    }
    #[cfg(not(all(unix, not(target_os = "macos"))))]
    {
        Ok(())
    }
}

/// Why no dialog was shown, if a library is missing.
pub(super) fn missing_library() -> Option<String> {
    #[cfg(target_os = "linux")]
    {
        // The first dialog loads the library.
        let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
        let missing = !maps.contains("libdbus-1.so");
        missing.then(|| "libdbus-1.so.3 is not installed".to_owned())
    }
    #[cfg(not(target_os = "linux"))]
    {
        None
    }
}

#[cfg(all(unix, not(target_os = "macos")))]
mod bus {
    use std::sync::mpsc::channel;
    use std::time::Duration;

    /// Long enough for the bus to start the portal.
    const TIMEOUT: Duration = Duration::from_secs(5);

    pub(super) fn check_desktop() -> Result<(), String> {
        let (send, answer) = channel();
        // A bus that does not answer leaves this thread running.
        let asking = std::thread::Builder::new().name("portal".to_owned());
        let started = asking.spawn(move || drop(send.send(pollster::block_on(ask()))));
        started.map_err(|error| format!("the session bus cannot be asked: {error}"))?;
        let silent = |_| "the session bus does not answer".to_owned();
        answer.recv_timeout(TIMEOUT).map_err(silent)?
    }

    /// Asks the portal for the version of its file dialogs, which it has only where the desktop has them.
    async fn ask() -> Result<(), String> {
        let none = |error: zbus::Error| {
            tracing::debug!("no session bus: {error}");
            "no session bus of the desktop can be reached".to_owned()
        };
        let bus = zbus::connection::Builder::session().map_err(none)?;
        let bus = bus.method_timeout(TIMEOUT).build().await.map_err(none)?;
        let property = ("org.freedesktop.portal.FileChooser", "version");
        bus.call_method(
            Some("org.freedesktop.portal.Desktop"),
            "/org/freedesktop/portal/desktop",
            Some("org.freedesktop.DBus.Properties"),
            "Get",
            &property,
        )
        .await
        .map(drop)
        .map_err(|error| {
            tracing::debug!("no desktop portal: {error}");
            "the desktop has no portal (xdg-desktop-portal) with file dialogs".to_owned()
        })
    }
}
