//! The window's side of the thread that makes pictures.
//!
//! The window orders pictures and shows those that come back; it never waits. A newer order for the
//! same place replaces one that has not begun. The device is another one than the window's own: a
//! frame that takes seconds, or a device that is lost, does not stop the window.

use super::arriving::Arrived;
use super::detail::Detail;
use super::worker::Worker;
use crate::arguments::{DeviceArguments, PluginFiles};
use crate::clouds::Clouds;
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_api::params::{ParamDecl, Values};
use surfelshop_api::{Scene, View};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_engine::picture::Development;
use surfelshop_engine::plugins::{Changed, Contents, Registry};
use surfelshop_engine::{Counters, Explanation, Image, PassReport};

/// Where a picture is shown: a pane and which of its two sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub(crate) pane: u32,
    pub(crate) side: usize,
}

/// What is wanted of a picture.
#[derive(Clone)]
pub(crate) struct Order {
    pub(crate) renderer: String,
    pub(crate) values: Values,
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) development: Development,
    pub(crate) view: View,
    /// How much of the clouds is drawn.
    pub(crate) detail: Detail,
    /// Whether something moves: the first frame is enough, since another order will follow.
    pub(crate) moves: bool,
    /// Whether it is measured instead of shown: nothing but colour is asked for, and pictures of views
    /// go first.
    pub(crate) is_measured: bool,
    /// Counts the orders of the window: a print says which one it answers.
    pub(crate) serial: u64,
}

/// A picture that was made.
#[derive(Clone)]
pub(crate) struct Shot {
    pub(crate) size: [u32; 2],
    /// As the screen shows it, four 8-bit values a pixel; none of pictures that are measured.
    pub(crate) levels: Vec<u8>,
    /// Linear radiance and coverage.
    pub(crate) color: Image,
    /// Distances along the viewing axis, 0 where nothing is; only of still pictures.
    pub(crate) depth: Option<Image>,
    pub(crate) view: View,
    pub(crate) passes: Vec<PassReport>,
    /// From order to picture, milliseconds.
    pub(crate) milliseconds: f64,
    /// What drawing took of it, milliseconds: this frame, or where pictures are measured or written, all
    /// of them.
    pub(crate) frame_ms: f64,
    /// What the renderer's own passes took of that on the device, milliseconds, where it tells.
    pub(crate) own_passes_ms: Option<f64>,
    /// Frames drawn so far.
    pub(crate) n_frames: u32,
    /// Whether another frame would refine it.
    pub(crate) refines: bool,
    pub(crate) detail: Detail,
    /// What it is made of; of still pictures alone.
    pub(crate) explained: Option<Arc<Explanation>>,
    /// One surfel of so many of a large cloud is shown, until all are there.
    pub(crate) one_of: u32,
}

impl Shot {
    /// Whether it shows all surfels and pixels.
    pub(crate) fn is_full(&self) -> bool {
        self.detail.is_full() && self.one_of == 1
    }

    /// Whether it shows everything, and will not change any more.
    pub(crate) fn is_whole(&self) -> bool {
        self.is_full() && !self.refines
    }

    /// How much it shows, in a few words.
    pub(crate) fn describe_detail(&self) -> String {
        Detail { stride: self.detail.stride * self.one_of, ..self.detail }.describe()
    }

    /// The levels as a picture of values in [0, 1].
    pub(crate) fn visible(&self) -> Image {
        let [width, height] = self.size;
        let data = self.levels.iter().map(|&level| f32::from(level) / 255.0).collect();
        Image { width, height, components: 4, data }
    }
}

/// The answer to an order.
pub(crate) struct Print {
    pub(crate) place: Place,
    pub(crate) serial: u64,
    pub(crate) renderer: String,
    /// The picture, or why there is none in one line.
    pub(crate) outcome: Result<Shot, String>,
}

/// What the thread tells the window.
pub(crate) enum News {
    /// The device is there.
    Open {
        adapter: String,
        /// Whether it computes on the CPU.
        software: bool,
    },
    /// There is no device; the reason in one line.
    NoDevice(String),
    /// What a renderer can be set to.
    Declared { renderer: String, parameters: Vec<ParamDecl> },
    /// A renderer's code is being loaded and its shaders compiled for the first time.
    Preparing { place: Place, renderer: String },
    /// The surfels of large clouds are being put in order, in [0, 1], or have been: pictures so far show a
    /// few of them.
    Arriving(Option<f32>),
    /// A picture, or why there is none.
    Print(Box<Print>),
    /// What the engine did so far.
    Counters(Counters),
    /// The plugins at hand, after one changed.
    Plugins(Registry),
    /// A rebuilt renderer is in use, in one line; its parameters came as [`News::Declared`].
    Reloaded(String),
    /// How units that failed behave, and which are switched off.
    Conduct(Vec<UnitConduct>),
    /// Something the user should know, in one line.
    Message(String),
}

/// A unit that failed at least once.
#[derive(Clone, Debug)]
pub(crate) struct UnitConduct {
    pub(crate) renderer: String,
    /// How, in one line.
    pub(crate) text: String,
    pub(crate) off: bool,
}

/// What the thread is to do next.
pub(crate) enum Task {
    Picture(Place, Box<Order>),
    /// Nothing else: a picture that is there may be refined.
    Refine,
    /// Nothing at all: what is not needed for the pictures on show can be let go.
    TidyUp,
    /// A plugin file changed.
    Changed(Changed),
    /// How far a large cloud is on its way, in [0, 1], with the number of its thread.
    Arriving(u64, f32),
    /// A large cloud is there.
    Arrived(Box<Arrived>),
    /// A renderer that was switched off is to be used again.
    SwitchOn(String),
    /// What is trusted has changed; these contents are, until the window is closed.
    Trust(Option<Contents>),
    /// A renderer is not to be used.
    Avoid(String),
    /// What is shown at a place is not refined any more.
    Rest(Place),
    /// Nothing is shown at a place any more.
    LetGo(Place),
    /// The device is to be lost, as a driver loses it.
    #[cfg(test)]
    LoseDevice,
}

/// What has not begun.
#[derive(Default)]
struct Waiting {
    orders: HashMap<Place, Order>,
    tasks: VecDeque<Task>,
    closed: bool,
}

/// Work on its way to the thread.
#[derive(Clone, Default)]
pub(crate) struct Queue(Arc<(Mutex<Waiting>, Condvar)>);

impl Queue {
    fn change(&self, change: impl FnOnce(&mut Waiting)) {
        let (waiting, bell) = &*self.0;
        change(&mut waiting.lock().unwrap_or_else(PoisonError::into_inner));
        bell.notify_one();
    }

    /// Adds a task that is done before any picture.
    pub(crate) fn add(&self, task: Task) {
        self.change(|waiting| waiting.tasks.push_back(task));
    }

    /// Orders a picture, instead of one for the same place that has not begun.
    pub(crate) fn order(&self, place: Place, order: Order) {
        self.change(|waiting| drop(waiting.orders.insert(place, order)));
    }

    /// The same, unless there is one for the place that has not begun.
    pub(crate) fn order_again(&self, place: Place, order: Order) {
        self.change(|waiting| {
            waiting.orders.entry(place).or_insert(order);
        });
    }

    /// Waits for a task; `None` when the window is gone. Of several pictures, the one ordered
    /// first by its number goes first, and pictures that are measured go last. From `refine` on there
    /// is always something to do: [`Task::Refine`]; and else from `tidy` on [`Task::TidyUp`].
    pub(crate) fn next(&self, refine: Option<Instant>, tidy: Option<Instant>) -> Option<Task> {
        let (waiting, bell) = &*self.0;
        let mut waiting = waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if waiting.closed {
                return None;
            }
            if let Some(task) = waiting.tasks.pop_front() {
                return Some(task);
            }
            let rank = |order: &Order| (order.is_measured, order.serial);
            let oldest = waiting.orders.iter().min_by_key(|(_, order)| rank(order));
            if let Some(place) = oldest.map(|(place, _)| *place) {
                let order = waiting.orders.remove(&place)?;
                return Some(Task::Picture(place, Box::new(order)));
            }
            let now = Instant::now();
            let is_due = |when: Option<Instant>| when.is_some_and(|when| when <= now);
            if is_due(refine) {
                return Some(Task::Refine);
            }
            if is_due(tidy) {
                return Some(Task::TidyUp);
            }
            let Some(first) = [refine, tidy].into_iter().flatten().min() else {
                waiting = bell.wait(waiting).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            let woken = bell.wait_timeout(waiting, first.saturating_duration_since(now));
            waiting = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// The window's end of the thread.
pub(crate) struct Darkroom {
    queue: Queue,
    news: Receiver<News>,
}

impl Darkroom {
    /// Starts the thread; `wake` is called when there is news.
    pub(crate) fn open(
        device: DeviceArguments,
        plugins: PluginFiles,
        wake: impl Fn() + Send + 'static,
    ) -> std::io::Result<Self> {
        let queue = Queue::default();
        let (send, news) = channel();
        let work = queue.clone();
        std::thread::Builder::new().name("darkroom".to_owned()).spawn(move || {
            let teller = Teller { send, wake: Box::new(wake) };
            if let Some(mut worker) = Worker::open(device, plugins, teller, &work) {
                worker.work(&work);
            }
        })?;
        Ok(Self { queue, news })
    }

    /// Orders a picture, instead of one for the same place that has not begun.
    pub(crate) fn order(&self, place: Place, order: Order) {
        self.queue.order(place, order);
    }

    /// Has something done before any picture.
    pub(crate) fn add(&self, task: Task) {
        self.queue.add(task);
    }

    /// Lets go of what makes the pictures of a place, and of an order for it.
    pub(crate) fn let_go(&self, place: Place) {
        self.queue.change(|waiting| {
            waiting.orders.remove(&place);
            waiting.tasks.push_back(Task::LetGo(place));
        });
    }

    /// What was told since the last call; a last line where the thread has ended by a fault.
    pub(crate) fn news(&self) -> Vec<News> {
        let mut all = Vec::new();
        loop {
            match self.news.try_recv() {
                Ok(news) => all.push(news),
                Err(TryRecvError::Empty) => return all,
                Err(TryRecvError::Disconnected) => {
                    if all.is_empty() {
                        let reason = "the thread that makes pictures has ended; save your scene \
                                      and start again";
                        all.push(News::NoDevice(reason.to_owned()));
                    }
                    return all;
                }
            }
        }
    }
}

/// How long the end of the thread is waited for: most pictures are done by then.
const FAREWELL: Duration = Duration::from_secs(2);

/// Whether a thread was still at work when its window closed.
static ABANDONED: AtomicBool = AtomicBool::new(false);

/// Whether a thread was still at work when its window closed. Leaving `main` would then take the
/// graphics driver from under it.
pub(crate) fn was_abandoned() -> bool {
    ABANDONED.load(Ordering::Relaxed)
}

/// Notes that a thread of a plugin is left behind.
pub(crate) fn abandon() {
    ABANDONED.store(true, Ordering::Relaxed);
}

impl Drop for Darkroom {
    /// Lets the thread end after the picture it is at, and waits for that a little.
    fn drop(&mut self) {
        self.queue.change(|waiting| waiting.closed = true);
        let last = Instant::now() + FAREWELL;
        loop {
            match self.news.recv_timeout(last.saturating_duration_since(Instant::now())) {
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => break,
            }
        }
        abandon();
    }
}

/// The thread's way to speak to the window.
pub(crate) struct Teller {
    send: Sender<News>,
    wake: Box<dyn Fn() + Send>,
}

impl Teller {
    pub(crate) fn tell(&self, news: News) {
        // The window may be gone already.
        drop(self.send.send(news));
        (self.wake)();
    }
}
