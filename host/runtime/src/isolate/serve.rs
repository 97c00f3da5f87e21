//! The process of a library: loads it, and does what the program orders.

use super::clouds::CloudHead;
use super::message::{Ask, Order, Outcome};
use super::process::leave_with_all;
use super::remote::{Program, RemoteSink, RemoteSource};
use super::wire::{Message, Part, Wire};
use crate::boundary::{Fault, Instance, Outputs, Plugin, TileCall};
use crate::plugins::{OpenError, leave, open};
use std::convert::Infallible;
use std::ffi::OsStr;
use std::io;
use std::os::fd::AsFd as _;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::net::UnixStream;
use std::os::unix::process::parent_id;
use std::path::Path;
use std::time::Duration;
use surfelshop_api::Traced;

/// How often a process looks whether its program is still there.
const LOOK: Duration = Duration::from_millis(500);

/// Does what the program orders that started this one, through the socket that it left as standard input, until that
/// ends. Returns where there is no such socket; the program's `main` then says so.
///
/// # Errors
/// Where the standard input is no socket.
pub fn serve() -> io::Result<Infallible> {
    let socket = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    socket.peer_addr()?;
    let parent = parent_id();
    // The library may be in an endless loop by then.
    std::thread::Builder::new().name("program".to_owned()).spawn(move || {
        loop {
            std::thread::sleep(LOOK);
            if parent_id() != parent {
                leave_with_all();
            }
        }
    })?;
    let program = Program::new(Wire::new(socket));
    let mut served = Served::default();
    loop {
        let message = program.order();
        let Ok(order) = message.head::<Order, Infallible>() else { leave(1) };
        let mut outputs = Outputs::default();
        let mut back = Vec::new();
        let done = served.execute(order, message, &program, (&mut outputs, &mut back));
        // The line of an error is in it.
        let written: Vec<(u32, &[u8])> = match &done {
            Ok(_) => outputs.channels().collect(),
            Err(_) => Vec::new(),
        };
        let outcome = Outcome::new(done, written.iter().map(|(channel, _)| *channel).collect());
        let mut parts: Vec<&[u8]> = written.iter().map(|(_, bytes)| *bytes).collect();
        parts.push(bytemuck::cast_slice(&back));
        program.tell(&Ask::Done(outcome), &parts);
    }
}

/// What this process has.
#[derive(Default)]
struct Served {
    plugin: Option<Plugin>,
    instance: Option<Instance>,
    scene: Option<Scene>,
}

/// The scene of a tracer, kept from tile to tile.
struct Scene {
    clouds: Vec<CloudHead>,
    /// Columns and triangles of the clouds, and the light.
    parts: Vec<Part>,
}

impl Scene {
    /// Calls with the scene as tracers see it.
    fn with<T>(&self, call: impl FnOnce(&Traced<'_>) -> T) -> T {
        let mut at = 0;
        let mut views = Vec::with_capacity(self.clouds.len());
        for cloud in &self.clouds {
            let parts = self.parts.get(at..).unwrap_or_default();
            views.push(cloud.view(&parts[..cloud.n_parts().min(parts.len())]));
            at += cloud.n_parts();
        }
        let texels = self.parts.get(at).map_or(&[][..], Part::bytes);
        let texels = bytemuck::try_cast_slice(texels).unwrap_or_default();
        call(&Traced { clouds: &views, texels })
    }
}

impl Served {
    fn plugin(&self) -> Result<Plugin, Fault> {
        self.plugin.ok_or_else(|| Fault::Misbehaved("no library is loaded".to_owned()))
    }

    fn instance(&mut self) -> Result<&mut Instance, Fault> {
        let lacks = || Fault::Misbehaved("no instance was made".to_owned());
        self.instance.as_mut().ok_or_else(lacks)
    }

    /// Does what was ordered; what is good is the minor version of the interface, where an instance was made.
    fn execute(
        &mut self,
        order: Order,
        mut message: Message,
        program: &Program,
        (outputs, back): (&mut Outputs, &mut Vec<f32>),
    ) -> Result<u16, Fault> {
        match order {
            Order::Load => {
                self.plugin = Some(load(message.part(0), message.part(1))?);
            }
            Order::Describe(unit) => self.plugin()?.description(unit, outputs)?,
            Order::Create(unit) => {
                let info = message.part(0).to_vec();
                let instance = self.instance.insert(self.plugin()?.create_from(unit, info)?);
                return Ok(instance.calls().minor());
            }
            Order::Frame => self.instance()?.calls().frame(message.part(0), outputs)?,
            Order::Tile(tile, scene) => {
                if let Some(clouds) = scene {
                    let parts = message.parts.split_off(1.min(message.parts.len()));
                    self.scene = Some(Scene { clouds, parts });
                }
                back.resize(4 * tile.width as usize * tile.height as usize, 0.0);
                let Self { instance: Some(instance), scene: Some(scene), .. } = self else {
                    return Err(Fault::Misbehaved("no scene was sent".to_owned()));
                };
                let request = message.part(0);
                scene.with(|scene| {
                    let call = TileCall { request, scene, tile, pixels: back };
                    instance.calls().tile(call, program)
                })?;
            }
            Order::Run(cloud) => {
                let cloud = cloud.view(message.parts.get(1..).unwrap_or_default());
                self.instance()?.calls().run(message.part(0), &cloud, program)?;
            }
            Order::Read(name) => {
                let (file, sink) = ((&name[..], program as _), &mut RemoteSink(program));
                self.instance()?.calls().read(message.part(0), file, sink, program)?;
            }
            Order::Write(name) => {
                let (file, source) =
                    ((&name[..], program as _), &mut RemoteSource { program, last: None });
                let request = message.part(0);
                self.instance()?.calls().write(request, source, file, program, outputs)?;
            }
        }
        Ok(0)
    }
}

/// Loads a library from its private copy.
fn load(copy: &[u8], name: &[u8]) -> Result<Plugin, Fault> {
    let [copy, name] = [copy, name].map(|path| Path::new(OsStr::from_bytes(path)));
    open(copy, name).map_err(|error| match error {
        OpenError::System(reason) => {
            let reason = reason.replace(&copy.display().to_string(), &name.display().to_string());
            Fault::Error(format!("it cannot be loaded: {reason}"))
        }
        OpenError::Plugin(fault) => fault,
    })
}
