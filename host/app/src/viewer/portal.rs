//! Whether the desktop has file dialogs to lend. Where it has none, asking it for one looks as if the user
//! had cancelled.

/// `Err` says why there is none. May wait for the desktop, so it is no question for the window's own thread.
pub(crate) fn lends_dialogs() -> Result<(), String> {
    #[cfg(all(unix, not(target_os = "macos")))]
    {
        bus::lends_dialogs()
    }
    #[cfg(not(all(unix, not(target_os = "macos"))))]
    {
        Ok(())
    }
}

/// Why a dialog that chose nothing was none at all, where that is known.
pub(crate) fn was_not_reached() -> Option<String> {
    #[cfg(target_os = "linux")]
    {
        // The library is loaded when the first dialog is asked for.
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

    /// The bus starts a portal that is not running yet.
    const PATIENCE: Duration = Duration::from_secs(5);

    pub(super) fn lends_dialogs() -> Result<(), String> {
        let (send, answer) = channel();
        // A bus that does not answer leaves this thread behind, and no dialog with it.
        let asking = std::thread::Builder::new().name("portal".to_owned());
        let started = asking.spawn(move || drop(send.send(pollster::block_on(ask()))));
        started.map_err(|error| format!("the session bus cannot be asked: {error}"))?;
        let silent = |_| "the session bus does not answer".to_owned();
        answer.recv_timeout(PATIENCE).map_err(silent)?
    }

    /// Asks the portal for the version of its file dialogs, which it has only where a desktop makes them.
    async fn ask() -> Result<(), String> {
        let none = |error: zbus::Error| {
            tracing::debug!("no session bus: {error}");
            "no session bus of the desktop can be reached".to_owned()
        };
        let bus = zbus::connection::Builder::session().map_err(none)?;
        let bus = bus.method_timeout(PATIENCE).build().await.map_err(none)?;
        let asked = ("org.freedesktop.portal.FileChooser", "version");
        bus.call_method(
            Some("org.freedesktop.portal.Desktop"),
            "/org/freedesktop/portal/desktop",
            Some("org.freedesktop.DBus.Properties"),
            "Get",
            &asked,
        )
        .await
        .map(drop)
        .map_err(|error| {
            tracing::debug!("no desktop portal: {error}");
            "the desktop has no portal (xdg-desktop-portal) with file dialogs".to_owned()
        })
    }
}
