/* Which objects of a room are seen from a camera: what er_gym/sim/space/visibility.py computes with
 * NumPy, in the same arithmetic (float for lines of sight, double for the picture), so that the
 * answers are equal to the bit. er_gym/sim/space/compiled.py compiles and calls it.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

/* One arrangement of N objects with P sample points and M boxes. The arrays are NumPy's, C order. */
typedef struct {
    intptr_t objects, boxes;
    const float *points;                          /* (P, 3) metres */
    const intptr_t *first_point, *point_count;     /* (N,) */
    const float *box_low, *box_high;              /* (M, 3) metres */
    const intptr_t *box_owner;                     /* (M,) */
    const uint8_t *removed;                       /* (M,) no longer there */
    const uint8_t *concealed;                     /* (N,) */
    const uint8_t *within;                        /* (N, N) row i: the receptacles that i is in */
    const uint8_t *from_outside, *slab, *carcass; /* (N,) see exemptions.py */
    const uint8_t *in_counter;                    /* (N,) */
} Arrangement;

/* A camera: the position, and the picture as exact values that NumPy has computed. */
typedef struct {
    double x, y, z; /* metres */
    double sin_yaw, cos_yaw, sin_pitch, cos_pitch;
    double near_plane, slope, aspect; /* metres, tangent of half the field of view, ratio */
} Camera;

static const float EPSILON = 1e-3f, TINY = 1e-9f;

/* A box seen from the eye: its corners less the eye's position. */
typedef struct {
    float low[3], high[3];
    intptr_t owner;
} Box;

static int in_picture(const Camera *camera, const float *point)
{
    double x = point[0] - camera->x, y = point[1] - camera->y, z = point[2] - camera->z;
    double right = x * camera->cos_yaw - z * camera->sin_yaw;
    double ahead = x * camera->sin_yaw + z * camera->cos_yaw;
    double forward = ahead * camera->cos_pitch - y * camera->sin_pitch;
    double up = ahead * camera->sin_pitch + y * camera->cos_pitch;
    if (!(forward > camera->near_plane)) return 0;
    forward *= camera->slope;
    if (!(fabs(up) <= forward)) return 0;
    forward *= camera->aspect;
    return fabs(right) <= forward;
}

static int crosses(const Box *box, const float *scale)
{
    float enter = -INFINITY, leave = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        float first = box->low[axis] * scale[axis], second = box->high[axis] * scale[axis];
        float lower = first < second ? first : second, upper = first < second ? second : first;
        enter = lower > enter ? lower : enter;
        leave = upper < leave ? upper : leave;
    }
    return enter > EPSILON && enter <= leave && leave < 1.0f - EPSILON;
}

static int exempt(const Arrangement *at, intptr_t i, intptr_t owner)
{
    if (at->within[i * at->objects + owner] && !at->slab[owner]) return 1;
    if (i == owner && !at->from_outside[i]) return 1;
    return at->in_counter[i] && at->carcass[owner];
}

/* The boxes that are still there, seen from the eye; returns how many. */
static intptr_t boxes_from(const Arrangement *at, const float *eye, Box *boxes)
{
    intptr_t count = 0;
    for (intptr_t m = 0; m < at->boxes; m++) {
        if (at->removed[m]) continue;
        for (int axis = 0; axis < 3; axis++) {
            boxes[count].low[axis] = at->box_low[3 * m + axis] - eye[axis];
            boxes[count].high[axis] = at->box_high[3 * m + axis] - eye[axis];
        }
        boxes[count++].owner = at->box_owner[m];
    }
    return count;
}

/* Those of the boxes that can hide object i; returns how many. */
static intptr_t boxes_before(const Arrangement *at, intptr_t i, const Box *boxes, intptr_t count, Box *some)
{
    intptr_t kept = 0;
    for (intptr_t b = 0; b < count; b++)
        if (!exempt(at, i, boxes[b].owner)) some[kept++] = boxes[b];
    return kept;
}

/* Whether a box stands between the eye and a point. What hides a point mostly hides the next one,
 * too, so `last`, the box that was found last, is tried first.
 */
static int hidden(const float *eye, const float *point, const Box *boxes, intptr_t count, intptr_t *last)
{
    float scale[3];
    for (int axis = 0; axis < 3; axis++) {
        float way = point[axis] - eye[axis];
        scale[axis] = 1.0f / (fabsf(way) < TINY ? TINY : way);
    }
    if (*last < count && crosses(&boxes[*last], scale)) return 1;
    for (intptr_t b = 0; b < count; b++)
        if (crosses(&boxes[b], scale)) {
            *last = b;
            return 1;
        }
    return 0;
}

/* Mark in (N,) `seen` the objects of which a point is in the picture with nothing before it.
 * Returns 1, or 0 if there is not enough memory.
 */
int er_gym_look(const Arrangement *at, const Camera *camera, uint8_t *seen)
{
    const float eye[3] = {(float)camera->x, (float)camera->y, (float)camera->z};
    Box *boxes = malloc((2 * at->boxes + 1) * sizeof(Box)), *some = boxes + at->boxes;
    if (!boxes) return 0;
    intptr_t count = boxes_from(at, eye, boxes);
    for (intptr_t i = 0; i < at->objects; i++) {
        intptr_t kept = -1, last = 0;
        const float *point = at->points + 3 * at->first_point[i];
        const float *end = point + 3 * at->point_count[i];
        seen[i] = 0;
        if (at->concealed[i]) continue;
        for (; point < end && !seen[i]; point += 3) {
            if (!in_picture(camera, point)) continue;
            if (kept < 0) kept = boxes_before(at, i, boxes, count, some);
            seen[i] = !hidden(eye, point, some, kept, &last);
        }
    }
    free(boxes);
    return 1;
}

/* Mark in (E, Q) `clear` whether nothing hides (Q, 3) points of object i from (E, 3) eyes, metres.
 * Returns 1, or 0 if there is not enough memory.
 */
int er_gym_unobstructed(const Arrangement *at, intptr_t i, const float *eyes, intptr_t eye_count,
                        const float *points, intptr_t point_count, uint8_t *clear)
{
    Box *boxes = malloc((2 * at->boxes + 1) * sizeof(Box)), *some = boxes + at->boxes;
    if (!boxes) return 0;
    for (const float *eye = eyes; eye < eyes + 3 * eye_count; eye += 3) {
        intptr_t last = 0, count = boxes_from(at, eye, boxes);
        count = boxes_before(at, i, boxes, count, some);
        for (intptr_t q = 0; q < point_count; q++)
            *clear++ = !hidden(eye, points + 3 * q, some, count, &last);
    }
    free(boxes);
    return 1;
}
