/* Libraries with the functions of k4a and k4abt that this project uses, and nothing behind them: two devices, of which the
   first is in use, and one person. Depth images, numbered from 1, come when the test says so, with FAKE_ITSELF by themselves to
   whoever waits; the tracker gives the number back in the time of its result, each after `late` requests that time out. The
   structures are written here a second time on purpose. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct { float rotation[9], translation[3]; } Extrinsics;
typedef struct { int type; unsigned count; float v[15]; } Intrinsics;
typedef struct { Extrinsics extrinsics; Intrinsics intrinsics; int width, height; float metric_radius; } Camera;
typedef struct { Camera depth, color; Extrinsics between[4][4]; int depth_mode, color_resolution; } Calibration;
typedef struct {
    int color_format, color_resolution, depth_mode, camera_fps; bool synchronized; int32_t delay; int wired;
    uint32_t subordinate_delay; bool no_light;
} Config;
typedef struct { int orientation, processing_mode; int32_t gpu; const char *model_path; } TrackerConfig;
typedef struct { float position[3], orientation[4]; int confidence; } Joint;
typedef struct { Joint joints[32]; } Skeleton;

#ifdef SENSOR
#define ROOM 64
static int devices, cameras, captures, came, given, pulled, numbers[ROOM];
int fake_arrive(void) { return ++came; }
int fake_pull(void) { return pulled = 1; }
int fake_open(void) { return devices * 100 + cameras * 10 + captures; }
uint32_t k4a_device_get_installed_count(void) { return 2; }
int k4a_device_open(uint32_t index, void **device) { if (index == 0) return 1; devices++; *device = &devices; return 0; }
void k4a_device_close(void *device) { devices--; }
int k4a_device_get_serialnum(void *device, char *text, size_t *size) {
    if (*size < 13) { *size = 13; return 2; }
    strcpy(text, "000123456712"); *size = 13; return 0;
}
int k4a_device_get_calibration(void *device, int mode, int resolution, Calibration *calibration) {
    memset(calibration, 0, sizeof *calibration);
    calibration->depth.width = 640; calibration->depth_mode = mode; calibration->color_resolution = resolution;
    calibration->between[3][3].translation[2] = 42.0f;
    return 0;
}
int k4a_device_start_cameras(void *device, const Config *config) {
    if (config->depth_mode != 2 || config->camera_fps != 2 || config->color_resolution != 0 || config->synchronized || config->no_light) return 1;
    cameras++; came = given = pulled = 0; return 0;
}
void k4a_device_stop_cameras(void *device) { cameras = 0; }
int k4a_device_get_capture(void *device, void **capture, int32_t timeout) {
    if (pulled) return 1;
#ifdef FAKE_ITSELF
    if (given == came && timeout) { usleep(33333); came++; }
#endif
    if (given == came) return 2;
    given++; captures++; numbers[given % ROOM] = given; *capture = &numbers[given % ROOM]; return 0;
}
void k4a_capture_release(void *capture) { captures--; }
#else
static int trackers, frames, mode, late, tries, waiting, queue[1000], result;
int fake_slow(void) { return late = 2; }
static float smoothing = 0.5f;
int fake_open(void) { return trackers * 10 + frames; }
float fake_smoothing(void) { return smoothing; }
int k4abt_tracker_create(const Calibration *calibration, TrackerConfig config, void **tracker) {
    if (calibration->depth.width != 640 || calibration->depth_mode != 2 || calibration->between[3][3].translation[2] != 42.0f) return 1;
    if (config.gpu != 0 || config.orientation != 0 || config.model_path) return 1;
    mode = config.processing_mode; trackers++; waiting = tries = 0; *tracker = &trackers; return 0;
}
void k4abt_tracker_shutdown(void *tracker) {}
void k4abt_tracker_destroy(void *tracker) { trackers--; }
void k4abt_tracker_set_temporal_smoothing(void *tracker, float factor) { smoothing = factor; }
int k4abt_tracker_enqueue_capture(void *tracker, void *capture, int32_t timeout) { if (waiting == 1000) return 2; queue[waiting++] = *(int *)capture; return 0; }
int k4abt_tracker_pop_result(void *tracker, void **frame, int32_t timeout) {
    if (waiting == 0 || tries++ < late) return 2;
    tries = 0; result = queue[0]; memmove(queue, queue + 1, --waiting * sizeof *queue);
    frames++; *frame = &frames; return 0;
}
void k4abt_frame_release(void *frame) { frames--; }
uint32_t k4abt_frame_get_num_bodies(void *frame) { return 2; }
uint32_t k4abt_frame_get_body_id(void *frame, uint32_t index) { return 10 * (index + 1) + mode; }
uint64_t k4abt_frame_get_device_timestamp_usec(void *frame) { return 5000000000ULL + 33333 * result; }
int k4abt_frame_get_body_skeleton(void *frame, uint32_t index, Skeleton *skeleton) {
    if (index == 1) return 1;
    for (int i = 0; i < 32; i++) {
        Joint *joint = &skeleton->joints[i];
        joint->position[0] = 100.0f + i; joint->position[1] = -200.0f - i; joint->position[2] = 3000.0f + i;
        joint->orientation[0] = 0.8f; joint->orientation[1] = 0.0f; joint->orientation[2] = 0.6f; joint->orientation[3] = 0.0f;
        joint->confidence = i % 4;
    }
    return 0;
}
#endif
