// Prefiltered occlusion textures (Eisemann, Decoret 2008, 3.2): built from the slices' bits, and looked up.
//
//   PREFILTER, STORAGE   as in occlusion_texture.cl
#ifndef PENUMBRA_OCCLUSION_LEVELS
#define PENUMBRA_OCCLUSION_LEVELS
#include "common/choices.h"
#include "common/shared.h"
#include "common/lanes.clh"

#ifndef PREFILTER
#define PREFILTER PREFILTER_NBUFFER
#endif
#ifndef STORAGE
#define STORAGE STORAGE_BINARY32
#endif

#define MOST_LAYERS 8
#define LEVEL_BLOCK 1024

#if PREFILTER == PREFILTER_TABLE
typedef uint element;
#elif STORAGE == STORAGE_NORMALIZED16
// 65535 is all of a texel. Sums of a few are whole numbers; a quarter goes to the nearest, halves to the even one.
typedef ushort element;
typedef uint stored;
typedef uint16 stored16;
typedef ushort16 element16;
#define ALL_FILLED 65535
#define STORED16 convert_uint16
#define ELEMENT16 convert_ushort16
#define SELECTOR as_uint16
#define QUARTER(sum) (((sum) + 1u + ((sum) >> 2 & 1u)) >> 2)
#define ROUNDED16(value) convert_uint16(rint(value))
#else
typedef float element;
typedef float stored;
typedef float16 stored16;
typedef float16 element16;
#define ALL_FILLED 1.0f
#define STORED16
#define ELEMENT16
#define SELECTOR
#define QUARTER(sum) (0.25f * (sum))
#define ROUNDED16(value) (value)
#endif

// Columns that a work-item makes where all sixteen could be made at once.
#define COLUMNS (LANES == 1 ? 1 : 16)

// Whether a texel's slice is filled. `layer`: -1, or that the slice be the column's filled one of this number, counted from the light; the last layer, `last`, takes
// all further ones. `leak_fix` (3.4.1): each slice is seen in the next one away from the light too.
inline __attribute__((always_inline)) bool filled(__global const uint* occupancy, const int2 size, const int x, const int y, const int slice, const int layer,
                                                  const int last, const int leak_fix)
{
    const int at = y * size.x + x, words = size.x * size.y;
    if (layer < 0) {
        const uint own = occupancy[at + (slice >> 5) * words] >> (slice & 31), before = slice > 0 ? slice - 1 : 0;
        return (own | (leak_fix ? occupancy[at + (int)(before >> 5) * words] >> (before & 31) : 0)) & 1;
    }
    const ulong bits = occupancy[at] | (ulong)occupancy[at + words] << 32;
    const ulong all = leak_fix ? bits | bits << 1 : bits;
    if (!(all >> slice & 1)) return false;
    const int before = popcount(all & (((ulong)1 << slice) - 1));
    return layer == last ? before >= last : before == layer;
}

// count_filled: how many texels of each texture are filled.
//
//   counts [textures]
//
// Launched over rows x textures.
__kernel void count_filled(const int2 size, const int textures, const int last, const int leak_fix, __global const OcclusionPlane* restrict planes,
                           __global const uint* restrict occupancy, __global int* restrict counts)
{
    const int y = get_global_id(0), texture = get_global_id(1);
    if (y >= size.y || texture >= textures) return;
    int count = 0;
    for (int x = 0; x < size.x; ++x) count += filled(occupancy, size, x, y, planes[texture].slice, planes[texture].layer, last, leak_fix);
    if (count > 0) atomic_add((volatile __global int*)counts + texture, count);
}

#if PREFILTER == PREFILTER_TABLE

// table_rows, table_columns: summed-area tables (Crow 1984) of integers, so that they are exact. table [textures][height + 1][width + 1]: how many filled texels lie
// below and to the left.
//
// Launched over rows x textures, then over columns x textures.
__kernel void table_rows(const int2 size, const int textures, const int last, const int leak_fix, __global const OcclusionPlane* restrict planes,
                         __global const uint* restrict occupancy, __global uint* restrict tables)
{
    const int y = get_global_id(0), texture = get_global_id(1);
    if (y > size.y || texture >= textures) return;
    __global uint* row = tables + ((long)texture * (size.y + 1) + y) * (size.x + 1);
    const int slice = planes[texture].slice, layer = planes[texture].layer;
    uint sum = 0;
    for (int x = 0; x <= size.x; ++x) {
        row[x] = sum;
        if (y > 0 && x < size.x) sum += filled(occupancy, size, x, y - 1, slice, layer, last, leak_fix);
    }
}

__kernel void table_columns(const int2 size, const int textures, __global uint* restrict tables)
{
    const int x = get_global_id(0), texture = get_global_id(1);
    if (x > size.x || texture >= textures) return;
    __global uint* at = tables + (long)texture * (size.y + 1) * (size.x + 1) + x;
    uint sum = 0;
    for (int y = 0; y <= size.y; ++y) {
        sum += at[(long)y * (size.x + 1)];
        at[(long)y * (size.x + 1)] = sum;
    }
}

// The mean of a texture over [x - half_x, x + half_x] x [y - half_y, y + half_y], in texels. Counts are subtracted as integers, whole texels apart from the parts of
// texels at either end: exact to the rounding of those parts. What is smaller than a sixteenth of a texel counts as that.
inline floatn mean_of_table(__global const uint* table, const int2 size, const floatn x, const floatn y, const floatn half_x, const floatn half_y)
{
    const floatn least = (floatn)(0x1p-5f), zero = (floatn)(0.0f);
    const floatn hx = select_lanes(least, half_x, half_x > least), hy = select_lanes(least, half_y, half_y > least);
    const floatn x0 = clamp(x - hx, zero, (floatn)(size.x)), x1 = clamp(x + hx, zero, (floatn)(size.x));
    const floatn y0 = clamp(y - hy, zero, (floatn)(size.y)), y1 = clamp(y + hy, zero, (floatn)(size.y));
    const intn ix0 = min(convert_intn(x0), (intn)(size.x - 1)), ix1 = min(convert_intn(x1), (intn)(size.x - 1));
    const intn iy0 = min(convert_intn(y0), (intn)(size.y - 1)), iy1 = min(convert_intn(y1), (intn)(size.y - 1));
    int column0[LANES], column1[LANES], row0[LANES], row1[LANES];
    store_int_lanes(ix0, column0);
    store_int_lanes(ix1, column1);
    store_int_lanes(iy0, row0);
    store_int_lanes(iy1, row1);
    // Whole texels from ix0 to ix1, the texel at ix1, the texel at ix0; each for the same three ranges of rows.
    int counts[9][LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        __global const uint* rows[4] = {table + row0[lane] * (size.x + 1), table + (row0[lane] + 1) * (size.x + 1), table + row1[lane] * (size.x + 1),
                                        table + (row1[lane] + 1) * (size.x + 1)};
        uint across[4][3];
        for (int i = 0; i < 4; ++i) {
            const uint a = rows[i][column0[lane]], b = rows[i][column0[lane] + 1], c = rows[i][column1[lane]], e = rows[i][column1[lane] + 1];
            across[i][0] = c - a;
            across[i][1] = e - c;
            across[i][2] = b - a;
        }
        for (int i = 0; i < 3; ++i) {
            counts[i][lane] = across[2][i] - across[0][i];
            counts[3 + i][lane] = across[3][i] - across[2][i];
            counts[6 + i][lane] = across[1][i] - across[0][i];
        }
    }
    const floatn first_x = x0 - convert_floatn(ix0), last_x = x1 - convert_floatn(ix1), first_y = y0 - convert_floatn(iy0), last_y = y1 - convert_floatn(iy1);
    floatn sums[3];
    for (int i = 0; i < 3; ++i)
        sums[i] = fma(last_x, convert_floatn(load_lanes(counts[3 * i + 1])), convert_floatn(load_lanes(counts[3 * i]))) -
                  first_x * convert_floatn(load_lanes(counts[3 * i + 2]));
    return (fma(last_y, sums[1], sums[0]) - first_y * sums[2]) / (4.0f * hx * hy);
}

#else

inline __attribute__((always_inline)) __global element* level_of(__global element* data, const OcclusionLevel level, const int texture)
{
    return data + (long)level.offset * LEVEL_BLOCK + (long)texture * level.rows * level.stride;
}

// first_level: the textures themselves, with the padding around.
//
// Launched over (stored columns / COLUMNS) x (stored rows x textures).
__kernel void first_level(const int2 size, const int textures, const int last, const int leak_fix, const OcclusionLevel level,
                          __global const OcclusionPlane* restrict planes, __global const uint* restrict occupancy, __global element* restrict data)
{
    const int x = get_global_id(0) * COLUMNS, row = get_global_id(1), texture = row / level.rows, y = row - texture * level.rows;
    if (x >= level.stride || texture >= textures) return;
    const int inside_x = x - (level.width - size.x) / 2, inside_y = y - (level.height - size.y) / 2;
    __global element* to = level_of(data, level, texture) + y * level.stride + x;
    for (int i = 0; i < COLUMNS; ++i) to[i] = 0;
    if (inside_y < 0 || inside_y >= size.y) return;
    const int slice = planes[texture].slice, layer = planes[texture].layer, from = max(0, -inside_x), end = min(COLUMNS, size.x - inside_x);
    for (int i = from; i < end; ++i)
        to[i] = filled(occupancy, size, inside_x + i, inside_y, slice, layer, last, leak_fix) ? ALL_FILLED : 0;
}

// Sixteen stored values of a row from x on; nothing beyond what is stored. The first and the last row and column hold nothing, and so do columns from the level's
// width to its stride: between these rows what is loaded beyond a row's ends is a part of the rows beside it.
inline __attribute__((always_inline)) stored16 stored_row(__global const element* texels, const OcclusionLevel level, const int x, const int y)
{
    const stored16 nothing = (stored16)(0);
    if (y <= 0 || y >= level.height - 1 || x <= -16 || x >= level.stride) return nothing;
    const stored16 values = STORED16(vload16(0, texels + y * level.stride + x));
    if (x >= 0 && x + 16 <= level.stride) return values;
    const int16 column = x + (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return select(nothing, values, SELECTOR(column >= 0 && column < level.stride));
}

inline __attribute__((always_inline)) stored stored_at(__global const element* texels, const OcclusionLevel level, const int x, const int y)
{
    return x >= 0 && y >= 0 && x < level.width && y < level.height ? texels[y * level.stride + x] : 0;
}

// Sixteen values of a level from the level below.
inline __attribute__((always_inline)) stored16 next_row(__global const element* from, const OcclusionLevel below, const OcclusionLevel level, const int apart,
                                                        const int x, const int y)
{
    const int dx = (below.width - level.width) / 2, dy = (below.height - level.height) / 2;
#if PREFILTER == PREFILTER_NBUFFER
    const int before = apart > 0 ? apart : 1, left = x + dx - before, right = x + dx + apart, low = y + dy - before, high = y + dy + apart;
    return QUARTER((stored_row(from, below, left, low) + stored_row(from, below, right, low)) +
                   (stored_row(from, below, left, high) + stored_row(from, below, right, high)));
#elif PREFILTER == PREFILTER_MIPMAP
    (void)apart, (void)dx, (void)dy;
    stored sums[16];
    for (int i = 0; i < 16; ++i) {
        const int left = 2 * (x + i) - 1, low = 2 * y - 1; // both levels have one column and row of nothing before the first
        sums[i] = (stored_at(from, below, left, low) + stored_at(from, below, left + 1, low)) +
                  (stored_at(from, below, left, low + 1) + stored_at(from, below, left + 1, low + 1));
    }
    return QUARTER(vload16(0, sums));
#else
    // The weights are binary fractions: the sums stay below 65535 and a half.
    const float weights[5] = {0.0625f, 0.25f, 0.375f, 0.25f, 0.0625f};
    float16 sum = (float16)(0.0f);
    for (int j = 0; j < 5; ++j) {
        float16 row = (float16)(0.0f);
        for (int i = 0; i < 5; ++i) row += weights[i] * convert_float16(stored_row(from, below, x + dx + (i - 2) * apart, y + dy + (j - 2) * apart));
        sum += weights[j] * row;
    }
    return ROUNDED16(sum);
#endif
}

// next_level: from the level below. N-buffers (Decoret 2005): the mean of 2^l x 2^l texels around every texel, from four means of half that size. Mip-maps: of every
// 2 x 2 texels. Smooth levels: 5 x 5 taps of (1, 4, 6, 4, 1) / 16 each way, 2^(l - 1) texels apart, which adds 4^(l - 1) to the variance.
//
//   apart   texels between the taps; N-buffers: from the middle to a tap, 2^(l - 2), and 0 for the first level, whose taps are the texel and the one before
//
// Launched over (stored columns / 16) x (stored rows x textures).
__kernel void next_level(const OcclusionLevel below, const OcclusionLevel level, const int textures, const int apart, __global element* restrict data)
{
    // Items of a work-group stand above each other; let them follow each other along rows, as memory does.
    const int number = get_global_id(0) * get_local_size(1) + get_local_id(1), chunks = get_global_size(0), along = number / chunks;
    const int x = (number - along * chunks) * 16, row = get_group_id(1) * get_local_size(1) + along, texture = row / level.rows, y = row - texture * level.rows;
    if (x >= level.stride || texture >= textures) return;
    const stored16 values = next_row(level_of(data, below, texture), below, level, apart, x, y);
    // Rows begin at multiples of sixteen elements: one aligned store, where vstore16 would store one by one.
    *(__global element16*)(level_of(data, level, texture) + y * level.stride + x) = ELEMENT16(values);
}

#if PREFILTER == PREFILTER_SMOOTH

// Of a disc wider than that of the highest level: that level seen from as much nearer to the window's middle, thinned by both widths. Level l stands for a disc
// 4 sqrt((4^l - 1) / 3) across (mean_of_levels).
inline __attribute__((always_inline)) floatn widest(const int count) { return (floatn)(4.0f * sqrt((exp2(2.0f * (count - 1)) - 1.0f) * (1.0f / 3))); }
inline __attribute__((always_inline)) floatn moved(const floatn at, const int size, const floatn wide, const floatn highest)
{
    const floatn middle = (floatn)(0.5f * size), nearer = select_lanes((floatn)(1.0f), highest / wide, wide > highest);
    return fma(at - middle, nearer, middle);
}

#else

// Of a kernel larger than the highest level's, which holds the whole window: the part of that level that lies inside the kernel, by moving it so that their nearer
// borders meet; then it is thinned by their sizes.
inline __attribute__((always_inline)) floatn widest(const int count) { return (floatn)((float)(1 << (count - 1))); }
inline __attribute__((always_inline)) floatn moved(const floatn at, const int size, const floatn wide, const floatn highest)
{
    const floatn zero = (floatn)(0.0f), over = select_lanes(zero, 0.5f * (wide - highest), wide > highest);
    const floatn middle = (floatn)(0.5f * size), away = at - middle, rest = fabs(away) - over;
    return middle + copysign(select_lanes(zero, rest, rest > zero), away);
}

#endif

// log2 of 1 or more: 2 / ln 2 atanh(s), s = (m - 1) / (m + 1), with m from sqrt(1/2) to sqrt(2), so that |s| <= 0.1716. The first term left out, 2 / ln 2 s^9 / 9, is
// below 2^-24. (PoCL's own log2 of a vector takes its lanes one by one.)
inline __attribute__((always_inline)) floatn log2_of(const floatn value)
{
    const intn bits = as_intn(value), exponent = (bits - 0x3f3504f3) >> 23; // of sqrt(1/2), less a half: 0x3f3504f3
    const floatn m = as_floatn(bits - (exponent << 23));
    const floatn s = (m - 1.0f) / (m + 1.0f), t = s * s;
    const floatn series = fma(t, fma(t, fma(t, (floatn)(1.0f / 7), (floatn)(1.0f / 5)), (floatn)(1.0f / 3)), (floatn)(1.0f));
    return fma(s * 0x1.715476p+1f, series, convert_floatn(exponent));
}

// Where in a level a place of the window lies: the texel below and the way to the next one. Beyond what is stored lies nothing, as in its first and last texels.
typedef struct {
    intn texel;
    floatn part;
} LevelPlace;

inline __attribute__((always_inline)) LevelPlace level_place(const floatn at, const float scale, const float shift, const int stored, intn* within)
{
    const floatn zero = (floatn)(0.0f), last = (floatn)(stored - 1.0f), place = fma(at, (floatn)(scale), (floatn)(shift));
    *within = place > zero & place < last;
    const floatn low = select_lanes(zero, place, place > zero), inside = select_lanes(last, low, low < last);
    LevelPlace found;
    found.texel = min(convert_intn(inside), (intn)(stored - 2));
    found.part = inside - convert_floatn(found.texel);
    return found;
}

// Between four texels, the first of which is at `places`.
inline __attribute__((always_inline)) floatn bilinear(__global const element* texels, const int stride, const intn places, const floatn across, const floatn up)
{
    int at[LANES];
    store_int_lanes(places, at);
#if STORAGE == STORAGE_NORMALIZED16
    // Two neighbours a load.
    int low[LANES], high[LANES];
    for (int lane = 0; lane < LANES; ++lane) low[lane] = as_int(vload2(0, texels + at[lane]));
    for (int lane = 0; lane < LANES; ++lane) high[lane] = as_int(vload2(0, texels + at[lane] + stride));
    const intn below = load_lanes(low), above = load_lanes(high);
#ifdef __ENDIAN_LITTLE__
#define FIRST_OF(pair) convert_floatn((pair)&0xffff)
#define SECOND_OF(pair) convert_floatn((pair) >> 16 & 0xffff)
#else
#define FIRST_OF(pair) convert_floatn((pair) >> 16 & 0xffff)
#define SECOND_OF(pair) convert_floatn((pair)&0xffff)
#endif
    const floatn below_left = FIRST_OF(below), below_right = SECOND_OF(below), above_left = FIRST_OF(above), above_right = SECOND_OF(above);
    const float unit = 1.0f / 65535.0f;
#else
    float values[4][LANES];
    for (int lane = 0; lane < LANES; ++lane) {
        values[0][lane] = texels[at[lane]];
        values[1][lane] = texels[at[lane] + 1];
        values[2][lane] = texels[at[lane] + stride];
        values[3][lane] = texels[at[lane] + stride + 1];
    }
    const floatn below_left = load_lanes(values[0]), below_right = load_lanes(values[1]), above_left = load_lanes(values[2]), above_right = load_lanes(values[3]);
    const float unit = 1.0f;
#endif
    const floatn below_mean = fma(across, below_right - below_left, below_left), above_mean = fma(across, above_right - above_left, above_left);
    return fma(up, above_mean - below_mean, below_mean) * unit;
}

// A texture around a place, in texels, for a kernel of `size` texels: bilinear within a level, linear between two (3.2). Neighbours' kernels are of about one size: each
// level that any of them needs is looked up for all at once, so that its layout is the same for all and only the loads are one by one.
inline __attribute__((always_inline)) floatn mean_of_levels(__global const OcclusionLevel* levels, const int count, const int2 window, __global const element* data,
                                                            const int texture, const floatn at_x, const floatn at_y, const floatn size)
{
    const floatn one = (floatn)(1.0f), zero = (floatn)(0.0f), most = (floatn)(count - 1);
    const floatn highest = widest(count), x = moved(at_x, window.x, size, highest), y = moved(at_y, window.y, size, highest);
    const floatn thinner = select_lanes(one, highest / size, size > highest);
#if PREFILTER == PREFILTER_SMOOTH
    // A square of `size` stands for a disc of that diameter, whose variance is size^2 / 16 along each axis; level l has (4^l - 1) / 3.
    const floatn place = 0.5f * log2_of(fma(size * size, (floatn)(3.0f / 16.0f), one));
#else
    const floatn place = log2_of(select_lanes(one, size, size > one));
#endif
    const floatn level = select_lanes(most, place, place < most);
    floatn sum = zero;
    for (int i = 0; i < count; ++i) {
        const floatn weight = one - fabs(level - (float)i);
        const intn counts = weight > zero;
        if (NONE(counts)) continue;
        const OcclusionLevel l = levels[i];
        intn within_x, within_y;
        const LevelPlace column = level_place(x, l.scale, l.shift, l.width, &within_x), row = level_place(y, l.scale, l.shift, l.height, &within_y);
        const intn meets = counts & within_x & within_y;
        if (NONE(meets)) continue;
        __global const element* texels = data + (long)l.offset * LEVEL_BLOCK + (long)texture * l.rows * l.stride;
        sum = fma(select_lanes(zero, weight, counts), bilinear(texels, l.stride, row.texel * l.stride + column.texel, column.part, row.part), sum);
    }
    return sum * (thinner * thinner);
}

#endif
#endif
