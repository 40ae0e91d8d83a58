/* A library with the functions of NiTE 2.2 that this project uses, and nothing behind them: one user who is seen, whose
   tracking is refused once, then tracked once somebody asks again, and lost at the end. Frames are told of when the test says so,
   with FAKE_ITSELF by themselves. The structures are written here a second time on purpose. */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

typedef struct { float x, y, z; } Point;
typedef struct { int type; Point position; float positionConfidence; float orientation[4]; float orientationConfidence; } Joint;
typedef struct { Joint joints[15]; int state; } Skeleton;
typedef struct { short id; Point min, max; Point centerOfMass; int state; Skeleton skeleton; struct { int type, state; } poses[2]; } User;
typedef struct { short *pixels; int width, height, stride; } Map;
typedef struct {
    int userCount; User *pUser; Map userMap; void *pDepthFrame; unsigned long long timestamp; int frameIndex;
    float floorConfidence; Point floorPoint, floorNormal;
} Frame;
typedef struct { int major, minor, maintenance, build; } Version;

typedef struct { void (*ready)(void *); } Callbacks;

static int initialised, trackers, out, started, reads, asked;
static Callbacks *callbacks;
static void *cookie;
static float smoothing = 0.5f;
static User user;
static Frame frame;

int fake_open(void) { return !!callbacks * 1000 + initialised * 100 + trackers * 10 + out; }
int fake_asked(void) { return asked; }
int fake_ready(void) { if (callbacks) callbacks->ready(cookie); return !!callbacks; }
float fake_smoothing(void) { return smoothing; }

int niteInitialize(void) { initialised++; return 0; }
void niteShutdown(void) { initialised--; }
Version niteGetVersion(void) { Version v = {2, FAKE_MINOR, 0, 11}; return v; }

int niteInitializeUserTracker(void **tracker) {
    FILE *data = fopen("NiTE2/s.dat", "r");
    if (!data) return 1;
    fclose(data);
    trackers++; started = reads = asked = 0;
    *tracker = &user;
    return 0;
}
int niteInitializeUserTrackerByDevice(void *device, void **tracker) { return ((void **)device)[1] ? niteInitializeUserTracker(tracker) : 1; }
int niteShutdownUserTracker(void *tracker) { trackers -= tracker == &user; return 0; }
int niteStartSkeletonTracking(void *tracker, short id) { if (++asked == 1) return 1; started = id; return 0; }
#ifdef FAKE_ITSELF
#include <pthread.h>
#include <unistd.h>
static pthread_t teller;
static volatile int telling;
static void *tell(void *unused) { while (telling) { callbacks->ready(cookie); usleep(33333); } return NULL; }
static void begin(void) { telling = 1; pthread_create(&teller, NULL, tell, NULL); }
static void end(void) { telling = 0; pthread_join(teller, NULL); }
#else
static void begin(void) {}
static void end(void) {}
#endif
int niteRegisterUserTrackerCallbacks(void *tracker, Callbacks *given, void *with) { callbacks = given; cookie = with; begin(); return 0; }
void niteUnregisterUserTrackerCallbacks(void *tracker, Callbacks *given) { if (callbacks == given) { end(); callbacks = NULL; } }
int niteSetSkeletonSmoothing(void *tracker, float factor) { smoothing = factor; return 0; }

int niteReadUserTrackerFrame(void *tracker, Frame **result) {
    if (++reads > 4) return 1;
    memset(&user, 0, sizeof user);
    user.id = 7;
    user.state = reads == 1 ? 1 | 2 : reads == 4 ? 4 : 1;
    user.skeleton.state = reads > 1 && started == 7 ? 2 : 0;
    for (int i = 0; i < 15; i++) {
        Joint *joint = &user.skeleton.joints[i];
        joint->type = i;
        joint->position.x = -300.0f + i;
        joint->position.y = 500.0f - 10 * i;
        joint->position.z = 2500.0f + i;
        joint->positionConfidence = i == 14 ? 0.0f : i == 13 ? 0.5f : 1.0f;
    }
    user.poses[1].state = -1;
    frame.userCount = 1;
    frame.pUser = &user;
    frame.timestamp = 1000000ULL + 33333ULL * reads;
    frame.frameIndex = reads;
    *result = &frame;
    out++;
    return 0;
}
int niteUserTrackerFrameRelease(void *tracker, Frame *given) { out -= given == &frame; return 0; }
