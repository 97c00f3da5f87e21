//! Calls on a unit in processes of its own: orders go there, and what the unit asks for meanwhile is answered.

use super::clouds::{self, CloudHead};
use super::message::{Ask, Order, Reply};
use super::package::Package;
use super::process::Process;
use super::wire::{Cut, Message};
use crate::boundary::{Calls, Fault, Lent, LentSink, NamedFile, Outputs, TileCall};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_api::CloudView;
use surfelshop_api::format::{CloudSinkHost, CloudSourceHost};
use surfelshop_api::job::JobHost;

/// Most bytes of a file that are read at once.
const MOST_READ: u64 = 1 << 30;

/// How long a process may be at work on an order.
#[derive(Clone, Copy, Debug)]
pub(super) enum Limit {
    /// So long.
    Within(Duration),
    /// As long as it takes, and so long after it was asked to stop.
    AfterStop(Duration),
}

/// An order with its parts.
type WithParts<'a> = (&'a Order, &'a [&'a [u8]]);

/// Has a process do something, and answers what it asks for. The outer error says that the process is lost, the inner one
/// what the library said; what is good is the minor version of the interface that it speaks.
pub(super) fn call(
    process: &mut Process,
    order: WithParts<'_>,
    limit: Limit,
    lent: &mut Lent<'_>,
) -> Result<Result<u16, Fault>, Fault> {
    call_for(process, order, limit, lent, &mut []).map(|(done, _)| done)
}

/// The same, where bytes come back besides the channels; says how many did.
fn call_for(
    process: &mut Process,
    (order, parts): WithParts<'_>,
    limit: Limit,
    lent: &mut Lent<'_>,
    back: &mut [u8],
) -> Result<(Result<u16, Fault>, usize), Fault> {
    let (started, mut asked_to_stop, job) = (Instant::now(), None::<Instant>, lent.job);
    let mut wait = || match limit {
        Limit::Within(limit) if started.elapsed() > limit => Err(Fault::TimedOut(limit)),
        Limit::AfterStop(limit) if job.is_some_and(JobHost::cancelled) => {
            let since = *asked_to_stop.get_or_insert_with(Instant::now);
            let line = "did not end when it was asked to, and its process was ended";
            if since.elapsed() > limit { Err(Fault::Error(line.to_owned())) } else { Ok(()) }
        }
        _ => Ok(()),
    };
    let mut done = || -> Result<_, Cut<Fault>> {
        process.wire.send(order, parts, &mut wait)?;
        loop {
            let message = process.wire.receive(&mut wait)?;
            let outcome = match message.head()? {
                Ask::Done(outcome) => outcome,
                ask => {
                    answer(process, &ask, &message, lent, &mut wait)?;
                    continue;
                }
            };
            for (i, channel) in outcome.channels.iter().enumerate() {
                lent.outputs.write(*channel, message.part(i));
            }
            let rest = message.part(outcome.channels.len());
            let n = rest.len().min(back.len());
            back[..n].copy_from_slice(&rest[..n]);
            // What was too much for a channel is said where what it wrote is looked at.
            let result = outcome.result().and_then(|minor| lent.outputs.check(0).map(|()| minor));
            return Ok((result, n));
        }
    };
    done().map_err(|cut| match cut {
        Cut::Stopped(fault) => {
            process.kill();
            fault
        }
        Cut::Closed(what) => process.lost(&what),
    })
}

/// Answers a question of a process.
fn answer(
    process: &mut Process,
    ask: &Ask,
    message: &Message,
    lent: &mut Lent<'_>,
    wait: &mut dyn FnMut() -> Result<(), Fault>,
) -> Result<(), Cut<Fault>> {
    let part = |i| message.part(i);
    let parts = |from: usize| -> Vec<&[u8]> { (from..message.parts.len()).map(part).collect() };
    let refused = |line: String| Reply::Refused(line);
    let done = |done: Result<(), String>| done.map_or_else(refused, |()| Reply::Done);
    let mut bytes: Vec<Vec<u8>> = Vec::new();
    let reply = match ask {
        Ask::Progress(fraction) => {
            lent.progress(*fraction, part(0));
            return Ok(());
        }
        Ask::Warn => {
            lent.warn(part(0));
            return Ok(());
        }
        // It is what ends a call, not a question.
        Ask::Done(_) => return Ok(()),
        Ask::Cancelled => Reply::Is(lent.cancelled()),
        Ask::Stage => done(lent.stage(part(0), &parts(1))),
        Ask::Compute(buffers) => match lent.compute(part(0), part(1), buffers) {
            Ok(contents) => {
                bytes = contents;
                Reply::Done
            }
            Err(line) => Reply::Refused(line),
        },
        Ask::Length => Reply::Count(lent.length()),
        Ask::ReadAt(offset, len) => match read_at(lent, *offset, (*len).min(MOST_READ) as usize) {
            Ok(found) => {
                let n = found.len() as u64;
                bytes.push(found);
                Reply::Count(n)
            }
            Err(line) => Reply::Refused(line),
        },
        Ask::WriteAt(offset) => done(lent.write_at(*offset, part(0))),
        Ask::Begin => lent.begin(part(0)).map_or_else(refused, Reply::Is),
        Ask::Batch => done(lent.batch(&parts(0))),
        Ask::Faces => done(match bytemuck::try_cast_slice(part(0)) {
            Ok(triangles) => lent.faces(triangles),
            Err(_cut) => Err("triangles: expected three corners each".to_owned()),
        }),
        Ask::NextCloud => match lent.next_cloud() {
            Ok(header) => {
                bytes.extend(header);
                Reply::Done
            }
            Err(line) => Reply::Refused(line),
        },
        Ask::NextBatch => {
            return match lent.next_batch() {
                Ok(Some(points)) => {
                    let reply = Reply::Points(Some(CloudHead::of(&points)));
                    process.wire.send(&reply, &clouds::parts(&points), wait)
                }
                Ok(None) => process.wire.send(&Reply::Points(None), &[], wait),
                Err(line) => process.wire.send(&Reply::Refused(line), &[], wait),
            };
        }
    };
    let parts: Vec<&[u8]> = bytes.iter().map(Vec::as_slice).collect();
    process.wire.send(&reply, &parts, wait)
}

/// Bytes of the file that a call lends.
fn read_at(lent: &Lent<'_>, offset: u64, len: usize) -> Result<Vec<u8>, String> {
    let mut buffer = Vec::new();
    buffer
        .try_reserve_exact(len)
        .map_err(|_out| format!("there is no memory for {len} bytes of the file"))?;
    buffer.resize(len, 0);
    let n = lent.read_at(offset, &mut buffer)?;
    buffer.truncate(n);
    Ok(buffer)
}

/// What a tracer's process has of a scene.
#[derive(Default, PartialEq)]
struct Scene {
    clouds: Vec<CloudHead>,
    /// Where the triangles lie, which have no generation.
    faces: Vec<usize>,
    texels: Vec<[f32; 3]>,
}

/// A process that has made an instance.
struct WithInstance {
    process: Process,
    scene: Option<Scene>,
}

/// A unit in processes of its own, with those that no call uses.
pub(super) struct Isolated {
    package: &'static Package,
    unit: u32,
    /// What instances are made from, msgpack.
    info: Vec<u8>,
    minor: u16,
    idle: Mutex<Vec<WithInstance>>,
}

impl Isolated {
    /// Makes an instance of a unit.
    pub(super) fn create(
        package: &'static Package,
        unit: u32,
        info: Vec<u8>,
    ) -> Result<Self, Fault> {
        let mut made = Self { package, unit, info, minor: 0, idle: Mutex::default() };
        let (instance, minor) = made.instance()?;
        made.minor = minor;
        made.idle = Mutex::new(vec![instance]);
        Ok(made)
    }

    /// Another instance of the unit, and the minor version of the interface that it speaks.
    fn instance(&self) -> Result<(WithInstance, u16), Fault> {
        let mut process = self.package.process()?;
        let limit = Limit::Within(self.package.timeouts.create);
        let (mut outputs, order) = (Outputs::default(), Order::Create(self.unit));
        let lent = &mut Lent::of(&mut outputs);
        let minor = call(&mut process, (&order, &[&self.info[..]]), limit, lent)??;
        Ok((WithInstance { process, scene: None }, minor))
    }

    /// Makes a call on an instance that nobody uses.
    fn call(
        &self,
        call: impl FnOnce(&mut WithInstance) -> Result<Result<u16, Fault>, Fault>,
    ) -> Result<(), Fault> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = idle().pop();
        let mut instance = match taken {
            Some(instance) => instance,
            None => self.instance()?.0,
        };
        let done = call(&mut instance)?;
        idle().push(instance);
        done.map(|_| ())
    }

    /// How long a call may take that lasts as long as it needs.
    fn after_stop(&self) -> Limit {
        Limit::AfterStop(self.package.timeouts.cancel)
    }
}

impl Calls for Isolated {
    fn minor(&self) -> u16 {
        self.minor
    }

    fn frame(&mut self, request: &[u8], outputs: &mut Outputs) -> Result<(), Fault> {
        let limit = Limit::Within(self.package.timeouts.frame);
        self.call(|instance| {
            let order = (&Order::Frame, &[request][..]);
            call(&mut instance.process, order, limit, &mut Lent::of(outputs))
        })
    }

    fn tile(&self, tile: TileCall<'_>, job: &dyn JobHost) -> Result<(), Fault> {
        let TileCall { request, scene, tile, pixels } = tile;
        let mut outputs = Outputs::default();
        let mut lent = Lent { job: Some(job), ..Lent::of(&mut outputs) };
        self.call(|instance| {
            let heads: Vec<CloudHead> = scene.clouds.iter().map(CloudHead::of).collect();
            let faces = scene.clouds.iter().map(|cloud| cloud.faces.as_ptr().addr()).collect();
            let is_there = instance.scene.as_ref().is_some_and(|known| {
                known.clouds == heads && known.faces == faces && known.texels == scene.texels
            });
            let mut parts = vec![request];
            if !is_there {
                parts.extend(scene.clouds.iter().flat_map(clouds::parts));
                parts.push(bytemuck::cast_slice(scene.texels));
            }
            let order = Order::Tile(tile, (!is_there).then(|| heads.clone()));
            let back: &mut [u8] = bytemuck::cast_slice_mut(pixels);
            let expected = back.len();
            let process = &mut instance.process;
            let (done, n) =
                call_for(process, (&order, &parts), self.after_stop(), &mut lent, back)?;
            if !is_there {
                instance.scene =
                    Some(Scene { clouds: heads, faces, texels: scene.texels.to_vec() });
            }
            Ok(match done {
                Ok(_) if n != expected => Err(Fault::Misbehaved(format!(
                    "its process sent {n} bytes of pixels, expected {expected}"
                ))),
                done => done,
            })
        })
    }

    fn run(
        &mut self,
        request: &[u8],
        cloud: &CloudView<'_>,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let mut lent = Lent { job: Some(job), ..Lent::of(&mut outputs) };
        let parts = [vec![request], clouds::parts(cloud)].concat();
        let (order, limit) = (Order::Run(CloudHead::of(cloud)), self.after_stop());
        self.call(|instance| call(&mut instance.process, (&order, &parts), limit, &mut lent))
    }

    fn read(
        &mut self,
        request: &[u8],
        (name, file): NamedFile<'_>,
        clouds: &mut dyn CloudSinkHost,
        job: &dyn JobHost,
    ) -> Result<(), Fault> {
        let mut outputs = Outputs::default();
        let clouds = Some(LentSink::new(clouds));
        let mut lent = Lent { job: Some(job), file: Some(file), clouds, ..Lent::of(&mut outputs) };
        let (order, limit) = (Order::Read(name.to_owned()), self.after_stop());
        self.call(|instance| call(&mut instance.process, (&order, &[request]), limit, &mut lent))
    }

    fn write(
        &mut self,
        request: &[u8],
        clouds: &mut dyn CloudSourceHost,
        (name, file): NamedFile<'_>,
        job: &dyn JobHost,
        outputs: &mut Outputs,
    ) -> Result<(), Fault> {
        let mut lent =
            Lent { job: Some(job), file: Some(file), source: Some(clouds), ..Lent::of(outputs) };
        let (order, limit) = (Order::Write(name.to_owned()), self.after_stop());
        self.call(|instance| call(&mut instance.process, (&order, &[request]), limit, &mut lent))
    }
}
