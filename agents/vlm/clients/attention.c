/* Attention of a few new tokens of each of many conversations to all tokens of its own up to
 * themselves, on several threads: what scaled_dot_product_attention computes, but for rounding,
 * and with the keys and values where each conversation keeps them. compiled_attention.py compiles
 * and calls it.
 *
 * The time is that of reading keys and values once. Torch's own takes a call and a dozen views for
 * each conversation, and twice the time within. Written in GCC's vectors: where another compiler
 * refuses them, torch's own is used.
 */
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define INLINE static inline __attribute__((always_inline))

/* A layer's new queries, keys and values of a batch. The sizes of a head are consecutive. */
typedef struct {
    intptr_t rows;                 /* conversations */
    intptr_t heads, groups, size;  /* of queries, of keys and values, of a head */
    const float *query, *key, *value; /* of all new tokens of the batch */
    intptr_t query_head, query_token, key_head, key_token, value_head, value_token; /* strides */
    float *found;                  /* (new tokens of the batch, heads, size) */
    const intptr_t *place;         /* (rows,) of its first token among the new ones */
    const intptr_t *count;         /* (rows,) its new tokens, side by side */
    const intptr_t *before;        /* (rows,) its tokens before the new ones */
    const intptr_t *room;          /* (rows,) tokens for which its memory has room */
    float *const *keys;            /* (rows,) its memory, (groups, room, size) */
    float *const *values;          /* (rows,) the same */
    float scale;                   /* of scores */
    intptr_t threads;
} Layer;

typedef struct {
    const Layer *layer;
    intptr_t first, last; /* rows, the last one not included */
    float *scores;        /* room for those of the longest row */
} Part;

/* e to the power of a number that is not above 0: Cephes' polynomial, relative error 2e-7. */
INLINE float power_of_e(float x)
{
    x = x < -87.0f ? -87.0f : x;
    float whole = __builtin_floorf(x * 1.44269504f + 0.5f);
    x = x - whole * 0.693359375f + whole * 2.12194440e-4f;
    float sum = 1.9875691500e-4f;
    sum = sum * x + 1.3981999507e-3f;
    sum = sum * x + 8.3334519073e-3f;
    sum = sum * x + 4.1665795894e-2f;
    sum = sum * x + 1.6666665459e-1f;
    sum = sum * x + 5.0000001201e-1f;
    sum = sum * x * x + x + 1.0f;
    union { int32_t bits; float value; } power = { ((int32_t)whole + 127) << 23 };
    return sum * power.value;
}

/* Sixteen numbers, wherever they are. */
typedef float Sixteen __attribute__((vector_size(64), aligned(4)));
typedef int32_t Places __attribute__((vector_size(64)));

INLINE Sixteen at(const float *numbers)
{
    return *(const Sixteen *)numbers;
}

/* The sums of two neighbours each, of a and then of b. */
INLINE Sixteen pairs(Sixteen a, Sixteen b)
{
    const Places even = {0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30};
    const Places odd = {1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31};
    return __builtin_shuffle(a, b, even) + __builtin_shuffle(a, b, odd);
}

/* The scores of 16 keys. */
INLINE Sixteen scores_of(const float *query, const float *keys, intptr_t size)
{
    Sixteen sums[16];
#pragma GCC unroll 16
    for (int t = 0; t < 16; t++) {
        sums[t] = at(query) * at(keys + t * size);
#pragma GCC unroll 8
        for (intptr_t d = 16; d < size; d += 16)
            sums[t] += at(query + d) * at(keys + t * size + d);
    }
#pragma GCC unroll 4
    for (int left = 8; left; left /= 2)
#pragma GCC unroll 8
        for (int t = 0; t < left; t++) sums[t] = pairs(sums[2 * t], sums[2 * t + 1]);
    return sums[0];
}

/* A head whose size is a multiple of 16 that is known when this is compiled. */
INLINE void one_head(const float *query, const float *keys, const float *values, float *scores,
                     float *found, intptr_t tokens, intptr_t size, float scale)
{
    float most = -INFINITY, total = 0.0f;
    intptr_t t = 0;
    for (; t + 16 <= tokens; t += 16)
        *(Sixteen *)(scores + t) = scores_of(query, keys + t * size, size) * scale;
    for (; t < tokens; t++) {
        float score = 0.0f;
        for (intptr_t d = 0; d < size; d++) score += query[d] * keys[t * size + d];
        scores[t] = score * scale;
    }
#pragma omp simd reduction(max : most)
    for (t = 0; t < tokens; t++) most = scores[t] > most ? scores[t] : most;
#pragma omp simd reduction(+ : total)
    for (t = 0; t < tokens; t++) {
        scores[t] = power_of_e(scores[t] - most);
        total += scores[t];
    }
    /* Four sums each, since an addition waits for the one before. */
    Sixteen sums[4][size / 16];
    memset(sums, 0, sizeof sums);
    for (t = 0; t + 4 <= tokens; t += 4)
#pragma GCC unroll 4
        for (int k = 0; k < 4; k++)
#pragma GCC unroll 8
            for (intptr_t d = 0; d < size / 16; d++)
                sums[k][d] += scores[t + k] * at(values + (t + k) * size + 16 * d);
    for (; t < tokens; t++)
        for (intptr_t d = 0; d < size / 16; d++)
            sums[0][d] += scores[t] * at(values + t * size + 16 * d);
    for (intptr_t d = 0; d < size / 16; d++)
        *(Sixteen *)(found + 16 * d) = (sums[0][d] + sums[1][d] + (sums[2][d] + sums[3][d])) / total;
}

/* A head of any size. */
INLINE void any_head(const float *query, const float *keys, const float *values, float *scores,
                     float *found, intptr_t tokens, intptr_t size, float scale)
{
    float most = -INFINITY, total = 0.0f;
    for (intptr_t t = 0; t < tokens; t++) {
        float score = 0.0f;
        for (intptr_t d = 0; d < size; d++) score += query[d] * keys[t * size + d];
        scores[t] = score * scale;
        most = scores[t] > most ? scores[t] : most;
    }
    memset(found, 0, size * sizeof(float));
    for (intptr_t t = 0; t < tokens; t++) {
        float weight = power_of_e(scores[t] - most);
        total += weight;
        for (intptr_t d = 0; d < size; d++) found[d] += weight * values[t * size + d];
    }
    for (intptr_t d = 0; d < size; d++) found[d] /= total;
}

INLINE void head_of_size(const float *query, const float *keys, const float *values, float *scores,
                         float *found, intptr_t tokens, intptr_t size, float scale)
{
    switch (size) {
    case 32: one_head(query, keys, values, scores, found, tokens, 32, scale); break;
    case 64: one_head(query, keys, values, scores, found, tokens, 64, scale); break;
    case 128: one_head(query, keys, values, scores, found, tokens, 128, scale); break;
    default: any_head(query, keys, values, scores, found, tokens, size, scale);
    }
}

static void rows_of(const Part *part)
{
    const Layer *in = part->layer;
    intptr_t shared = in->heads / in->groups;
    for (intptr_t row = part->first; row < part->last; row++) {
        intptr_t before = in->before[row], place = in->place[row], count = in->count[row];
        for (intptr_t group = 0; group < in->groups; group++) {
            float *keys = in->keys[row] + group * in->room[row] * in->size;
            float *values = in->values[row] + group * in->room[row] * in->size;
            for (intptr_t new = 0; new < count; new++) {
                memcpy(keys + (before + new) * in->size,
                       in->key + group * in->key_head + (place + new) * in->key_token,
                       in->size * sizeof(float));
                memcpy(values + (before + new) * in->size,
                       in->value + group * in->value_head + (place + new) * in->value_token,
                       in->size * sizeof(float));
            }
            for (intptr_t head = group * shared; head < (group + 1) * shared; head++)
                for (intptr_t new = 0; new < count; new++)
                    head_of_size(in->query + head * in->query_head
                                     + (place + new) * in->query_token,
                                 keys, values, part->scores,
                                 in->found + ((place + new) * in->heads + head) * in->size,
                                 before + new + 1, in->size, in->scale);
        }
    }
}

static void *run(void *part)
{
    rows_of(part);
    return NULL;
}

/* Keeps the new keys and values and computes what is found; 0, or -1 if there is no memory. */
int er_gym_attend(const Layer *layer)
{
    intptr_t threads = layer->threads < layer->rows ? layer->threads : layer->rows;
    intptr_t all = 0, longest = 0;
    for (intptr_t row = 0; row < layer->rows; row++) {
        intptr_t tokens = layer->before[row] + layer->count[row];
        all += tokens * layer->count[row];
        if (tokens > longest) longest = tokens;
    }
    if (threads < 1) return 0;
    Part *parts = malloc(threads * sizeof(Part));
    pthread_t *others = malloc(threads * sizeof(pthread_t));
    float *scores = malloc(threads * longest * sizeof(float));
    if (!parts || !others || !scores) {
        free(parts); free(others); free(scores);
        return -1;
    }
    intptr_t row = 0, done = 0;
    for (intptr_t number = 0; number < threads; number++) {
        Part *part = parts + number;
        *part = (Part){layer, row, row, scores + number * longest};
        for (; row < layer->rows && (number == threads - 1 || done * threads < (number + 1) * all);
             row++)
            done += (layer->before[row] + layer->count[row]) * layer->count[row];
        part->last = row;
        /* What has no thread of its own is done here. */
        if (number == threads - 1 || pthread_create(others + number, NULL, run, part))
            rows_of(part), part->scores = NULL;
    }
    for (intptr_t number = 0; number < threads; number++)
        if (parts[number].scores) pthread_join(others[number], NULL);
    free(parts); free(others); free(scores);
    return 0;
}
