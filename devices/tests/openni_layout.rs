//! The declarations of OpenNI2's types against its installed headers, as a C++ compiler lays them out.
//!
//! Needs `c++` and the headers (Debian: `libopenni2-dev`); says so and passes where they are not.

use std::mem::offset_of;
use std::path::Path;
use std::process::Command;

use posefuse_devices::openni::c;

const HEADERS: &str = "/usr/include/openni2";

/// What is asked of the compiler, and what our declarations say.
fn questions() -> Vec<(&'static str, usize)> {
    macro_rules! of {
        ($($kind:ident: $($field:ident = $theirs:literal),*;)*) => {
            vec![$(
                (concat!("sizeof(", stringify!($kind), ")"), size_of::<c::$kind>()),
                $((
                    concat!("offsetof(", stringify!($kind), ", ", $theirs, ")"),
                    offset_of!(c::$kind, $field),
                ),)*
            )*]
        };
    }
    let mut questions = of! {
        OniVersion: build = "build";
        OniVideoMode: pixel_format = "pixelFormat", resolution_x = "resolutionX", fps = "fps";
        OniSensorInfo: num_supported_video_modes = "numSupportedVideoModes",
            supported_video_modes = "pSupportedVideoModes";
        OniDeviceInfo: uri = "uri", vendor = "vendor", name = "name", usb_vendor_id = "usbVendorId",
            usb_product_id = "usbProductId";
        OniFrame: data_size = "dataSize", data = "data", sensor_type = "sensorType", timestamp = "timestamp",
            frame_index = "frameIndex", width = "width", height = "height", video_mode = "videoMode",
            cropping_enabled = "croppingEnabled", crop_origin_x = "cropOriginX", crop_origin_y = "cropOriginY",
            stride = "stride";
        OniDeviceCallbacks: device_connected = "deviceConnected", device_disconnected = "deviceDisconnected",
            device_state_changed = "deviceStateChanged";
        OniStreamServices: stream_services = "streamServices", acquire_frame = "acquireFrame",
            release_frame = "releaseFrame";
    };
    let constants: [(&str, i32); 21] = [
        ("ONI_API_VERSION", c::API_VERSION),
        ("ONI_STATUS_NOT_IMPLEMENTED", c::STATUS_NOT_IMPLEMENTED),
        ("ONI_STATUS_NOT_SUPPORTED", c::STATUS_NOT_SUPPORTED),
        ("ONI_STATUS_BAD_PARAMETER", c::STATUS_BAD_PARAMETER),
        ("ONI_STATUS_OUT_OF_FLOW", c::STATUS_OUT_OF_FLOW),
        ("ONI_STATUS_NO_DEVICE", c::STATUS_NO_DEVICE),
        ("ONI_STATUS_TIME_OUT", c::STATUS_TIME_OUT),
        ("ONI_SENSOR_DEPTH", c::SENSOR_DEPTH),
        ("ONI_PIXEL_FORMAT_DEPTH_1_MM", c::PIXEL_DEPTH_1_MM),
        ("ONI_PIXEL_FORMAT_DEPTH_100_UM", c::PIXEL_DEPTH_100_UM),
        ("ONI_DEVICE_STATE_EOF", c::DEVICE_STATE_EOF),
        ("ONI_DEVICE_PROPERTY_SERIAL_NUMBER", c::DEVICE_SERIAL_NUMBER),
        (
            "ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION",
            c::DEVICE_IMAGE_REGISTRATION,
        ),
        (
            "ONI_DEVICE_PROPERTY_PLAYBACK_SPEED",
            c::DEVICE_PLAYBACK_SPEED,
        ),
        (
            "ONI_DEVICE_PROPERTY_PLAYBACK_REPEAT_ENABLED",
            c::DEVICE_PLAYBACK_REPEAT,
        ),
        (
            "ONI_STREAM_PROPERTY_HORIZONTAL_FOV",
            c::STREAM_HORIZONTAL_FOV,
        ),
        ("ONI_STREAM_PROPERTY_VIDEO_MODE", c::STREAM_VIDEO_MODE),
        ("ONI_STREAM_PROPERTY_MAX_VALUE", c::STREAM_MAX_VALUE),
        ("ONI_STREAM_PROPERTY_STRIDE", c::STREAM_STRIDE),
        ("ONI_STREAM_PROPERTY_MIRRORING", c::STREAM_MIRRORING),
        (
            "ONI_STREAM_PROPERTY_NUMBER_OF_FRAMES",
            c::STREAM_NUMBER_OF_FRAMES,
        ),
    ];
    questions.extend(constants.map(|(name, value)| (name, value as usize)));
    questions
}

#[test]
fn types_and_constants_are_as_the_installed_headers_have_them() {
    if !Path::new(HEADERS).join("OniCAPI.h").exists()
        || Command::new("c++").arg("--version").output().is_err()
    {
        eprintln!(
            "SKIPPED: no OpenNI2 headers in {HEADERS} (Debian: apt install libopenni2-dev), or no `c++`"
        );
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("layout.cpp");
    let questions = questions();
    let asked: Vec<String> = questions
        .iter()
        .map(|(what, _)| format!("  std::printf(\"%zu\\n\", (size_t)({what}));\n"))
        .collect();
    let text = format!(
        "#include <cstddef>\n#include <cstdio>\n#include <stdint.h>\n#include <OniCAPI.h>\n\
         #include <Driver/OniDriverTypes.h>\nint main() {{\n{}}}\n",
        asked.concat()
    );
    std::fs::write(&source, text).unwrap();
    let program = folder.path().join("layout");
    let compiled = Command::new("c++")
        .args(["-w", "-I", HEADERS, "-o"])
        .args([&program, &source])
        .output()
        .unwrap();
    assert!(
        compiled.status.success(),
        "{}",
        String::from_utf8_lossy(&compiled.stderr)
    );
    let said = Command::new(&program).output().unwrap().stdout;
    let said = String::from_utf8(said).unwrap();
    let theirs: Vec<usize> = said.lines().map(|line| line.parse().unwrap()).collect();
    assert_eq!(theirs.len(), questions.len());
    for ((what, ours), theirs) in questions.iter().zip(theirs) {
        assert_eq!(*ours, theirs, "{what}");
    }
}
