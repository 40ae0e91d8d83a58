//! A depth stream of a simulated sensor.

use std::ffi::c_int;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use posefuse_devices::openni::c::{
    OniStatus, OniVideoMode, PIXEL_DEPTH_1_MM, STATUS_BAD_PARAMETER, STATUS_ERROR,
    STATUS_NO_DEVICE, STATUS_NOT_SUPPORTED, STATUS_OK, STATUS_OUT_OF_FLOW, STREAM_CROPPING,
    STREAM_HORIZONTAL_FOV, STREAM_MAX_VALUE, STREAM_MIN_VALUE, STREAM_MIRRORING, STREAM_STRIDE,
    STREAM_VERTICAL_FOV, STREAM_VIDEO_MODE,
};
use posefuse_simulator::depth::DepthCamera;

use crate::outward::{FrameOutlet, NewFrame, Outgoing, PropertyNews, Theirs};
use crate::render::{self, Drawn};
use crate::sensor::{FPS, VirtualSensor};

/// What the stream has properties of, in the order in which they are told.
const PROPERTIES: [c_int; 8] = [
    STREAM_VIDEO_MODE,
    STREAM_CROPPING,
    STREAM_HORIZONTAL_FOV,
    STREAM_VERTICAL_FOV,
    STREAM_MAX_VALUE,
    STREAM_MIN_VALUE,
    STREAM_STRIDE,
    STREAM_MIRRORING,
];

/// The sizes that it can have; the first is the usual one.
const SIZES: [[u32; 2]; 2] = [[320, 240], [640, 480]];

/// The depth modes.
pub(crate) fn modes() -> Vec<OniVideoMode> {
    let mode = |[width, height]: [u32; 2]| OniVideoMode {
        pixel_format: PIXEL_DEPTH_1_MM,
        resolution_x: width as c_int,
        resolution_y: height as c_int,
        fps: FPS as c_int,
    };
    SIZES.map(mode).to_vec()
}

/// A stream as OpenNI2 holds it.
#[derive(Debug)]
pub(crate) struct VirtualStream {
    sensor: Arc<VirtualSensor>,
    /// The stay of the sensor that it was made in; in another one it is dead.
    stay: u64,
    settings: Mutex<Settings>,
    /// As with the sensors of PrimeSense, on unless somebody switches it off.
    mirrored: Arc<AtomicBool>,
    running: Mutex<Option<Running>>,
}

#[derive(Clone, Copy, Debug)]
struct Settings {
    mode: OniVideoMode,
    services: Option<Theirs>,
    frames: Option<(NewFrame, Theirs, Theirs)>,
    news: Option<PropertyNews>,
}

#[derive(Debug)]
struct Running {
    stop: Arc<Stop>,
    flow: JoinHandle<()>,
    drawing: JoinHandle<()>,
}

#[derive(Debug, Default)]
struct Stop {
    asked: Mutex<bool>,
    changed: Condvar,
}

/// A lock whose holder cannot leave anything half done.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stop {
    fn ask(&self) {
        *locked(&self.asked) = true;
        self.changed.notify_all();
    }

    /// Waits until then; `true` if asked to stop before.
    fn until(&self, moment: Instant) -> bool {
        let mut asked = locked(&self.asked);
        loop {
            let left = moment.saturating_duration_since(Instant::now());
            if *asked || left.is_zero() {
                return *asked;
            }
            let waited = self.changed.wait_timeout(asked, left);
            asked = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

impl VirtualStream {
    pub(crate) fn new(sensor: &Arc<VirtualSensor>, stay: u64) -> Self {
        Self {
            sensor: sensor.clone(),
            stay,
            settings: Mutex::new(Settings {
                mode: modes()[0],
                services: None,
                frames: None,
                news: None,
            }),
            mirrored: Arc::new(AtomicBool::new(true)),
            running: Mutex::new(None),
        }
    }

    pub(crate) fn set_services(&self, services: Theirs) {
        locked(&self.settings).services = Some(services);
    }

    pub(crate) fn set_frame_callback(
        &self,
        handler: Option<NewFrame>,
        stream: Theirs,
        cookie: Theirs,
    ) {
        locked(&self.settings).frames = handler.map(|handler| (handler, stream, cookie));
    }

    pub(crate) fn set_property_callback(&self, news: Option<PropertyNews>) {
        locked(&self.settings).news = news;
    }

    pub(crate) fn has(property: c_int) -> bool {
        PROPERTIES.contains(&property)
    }

    /// A property's value, as C has it in memory.
    pub(crate) fn get(&self, property: c_int) -> Option<Vec<u8>> {
        let settings = *locked(&self.settings);
        let view = camera(&settings.mode).intrinsics.view();
        let int = |value: c_int| Some(value.to_ne_bytes().to_vec());
        let float = |value: f64| Some((value as f32).to_ne_bytes().to_vec());
        match property {
            STREAM_VIDEO_MODE => {
                let OniVideoMode {
                    pixel_format,
                    resolution_x,
                    resolution_y,
                    fps,
                } = settings.mode;
                let numbers = [pixel_format, resolution_x, resolution_y, fps];
                Some(numbers.into_iter().flat_map(c_int::to_ne_bytes).collect())
            }
            // There is none, and OpenNI2's player shows no frame of a recording that does not say so.
            STREAM_CROPPING => {
                let whole = [
                    0,
                    0,
                    0,
                    settings.mode.resolution_x,
                    settings.mode.resolution_y,
                ];
                Some(whole.into_iter().flat_map(c_int::to_ne_bytes).collect())
            }
            STREAM_HORIZONTAL_FOV => float(view[0]),
            STREAM_VERTICAL_FOV => float(view[1]),
            STREAM_MAX_VALUE => int(10_000),
            STREAM_MIN_VALUE => int(0),
            STREAM_STRIDE => int(settings.mode.resolution_x * size_of::<u16>() as c_int),
            STREAM_MIRRORING => int(self.mirrored.load(Ordering::Relaxed).into()),
            _ => None,
        }
    }

    pub(crate) fn set(&self, property: c_int, value: &[u8]) -> OniStatus {
        let numbers: Vec<c_int> = value
            .chunks_exact(4)
            .filter_map(|bytes| Some(c_int::from_ne_bytes(bytes.try_into().ok()?)))
            .collect();
        let status = match (property, numbers.as_slice()) {
            (STREAM_CROPPING, [0, ..]) => STATUS_OK,
            (STREAM_MIRRORING, [on]) => {
                self.mirrored.store(*on != 0, Ordering::Relaxed);
                STATUS_OK
            }
            (STREAM_VIDEO_MODE, [format, width, height, fps]) => {
                let wanted = |mode: &OniVideoMode| {
                    [
                        mode.pixel_format,
                        mode.resolution_x,
                        mode.resolution_y,
                        mode.fps,
                    ] == [*format, *width, *height, *fps]
                };
                match modes().into_iter().find(wanted) {
                    Some(_) if locked(&self.running).is_some() => STATUS_OUT_OF_FLOW,
                    Some(mode) => {
                        locked(&self.settings).mode = mode;
                        STATUS_OK
                    }
                    None => STATUS_BAD_PARAMETER,
                }
            }
            _ => STATUS_NOT_SUPPORTED,
        };
        if status == STATUS_OK {
            self.tell(property);
        }
        status
    }

    /// Tells OpenNI2 every property; its recorder writes them into the file.
    pub(crate) fn tell_all(&self) {
        PROPERTIES.iter().for_each(|&property| self.tell(property));
    }

    fn tell(&self, property: c_int) {
        let news = locked(&self.settings).news;
        if let (Some(news), Some(value)) = (news, self.get(property)) {
            news.tell(property, &value);
        }
    }

    /// How many bytes a frame has.
    pub(crate) fn frame_size(&self) -> c_int {
        let mode = locked(&self.settings).mode;
        mode.resolution_x * mode.resolution_y * size_of::<u16>() as c_int
    }

    pub(crate) fn start(&self) -> OniStatus {
        let mut running = locked(&self.running);
        if running.is_some() {
            return STATUS_OK;
        }
        if self.sensor.stay() != Some(self.stay) {
            return STATUS_NO_DEVICE;
        }
        let settings = *locked(&self.settings);
        let (Some(services), Some((handler, stream, cookie))) =
            (settings.services, settings.frames)
        else {
            return STATUS_OUT_OF_FLOW;
        };
        let flow = Flow {
            sensor: self.sensor.clone(),
            stay: self.stay,
            mode: settings.mode,
            outlet: FrameOutlet {
                services,
                handler,
                stream,
                cookie,
            },
            mirrored: self.mirrored.clone(),
            stop: Arc::default(),
        };
        let (stop, start) = (flow.stop.clone(), Instant::now());
        let drawn = render::draw(self.sensor.clone(), camera(&settings.mode), start);
        let Ok((frames, drawing)) = drawn else {
            return STATUS_ERROR;
        };
        let flow = thread::Builder::new()
            .name(format!("virtual-{}", self.sensor.index))
            .spawn(move || flow.run(&frames));
        match flow {
            Ok(flow) => {
                *running = Some(Running {
                    stop,
                    flow,
                    drawing,
                });
                STATUS_OK
            }
            Err(_) => {
                // Its frames' receiver went with the thread that could not be started.
                let _ = drawing.join();
                STATUS_ERROR
            }
        }
    }

    pub(crate) fn stop(&self) {
        if let Some(running) = locked(&self.running).take() {
            running.stop.ask();
            // A thread that panicked has no more frames: it is stopped, too. The first one's end ends the other.
            let _ = running.flow.join();
            let _ = running.drawing.join();
        }
    }
}

impl Drop for VirtualStream {
    fn drop(&mut self) {
        self.stop();
    }
}

/// What the thread of a running stream has.
struct Flow {
    sensor: Arc<VirtualSensor>,
    stay: u64,
    mode: OniVideoMode,
    outlet: FrameOutlet,
    mirrored: Arc<AtomicBool>,
    stop: Arc<Stop>,
}

impl Flow {
    /// Gives each frame when it is due, until the stream is stopped or the sensor pulled out.
    fn run(&self, frames: &Receiver<Drawn>) {
        loop {
            let drawn = match frames.recv_timeout(Duration::from_millis(100)) {
                Ok(drawn) => drawn,
                Err(RecvTimeoutError::Timeout) if self.stop.until(Instant::now()) => return,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => return,
            };
            let late = self.sensor.delay + self.sensor.jitter.mul_f64(scatter(drawn.number));
            if self.stop.until(drawn.at + late) || self.sensor.stay() != Some(self.stay) {
                return;
            }
            self.outlet.give(&Outgoing {
                pixels: &drawn.image.millimetres,
                mode: self.mode,
                number: drawn.number as c_int,
                timestamp_us: self.sensor.clock.shows_us(drawn.at),
                mirrored: self.mirrored.load(Ordering::Relaxed),
            });
        }
    }
}

/// A number in 0..1 that looks random and is the same for the same frame.
fn scatter(number: u32) -> f64 {
    let mixed = u64::from(number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (mixed >> 40) as f64 / (1u64 << 24) as f64
}

fn camera(mode: &OniVideoMode) -> DepthCamera {
    let side = |pixels: c_int| u32::try_from(pixels).unwrap_or(1);
    DepthCamera::structured_light(side(mode.resolution_x), side(mode.resolution_y))
}
