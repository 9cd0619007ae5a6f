// Ray-traced visibility: shadow rays from each receiver to stratified, jittered points on the light.
//
// Each receiver is moved to the camera's side of the surface that it lies on (surface.hpp) and sees the light's samples or does not.
// Visibility is the share that it sees; for a textured light the share of what they emit.
//
// adaptive: every receiver first casts `first_samples` rays, with strata of their own. A tile of 4 x 4 pixels is settled when all its rays
// and those of the eight tiles around it agree, all free or all blocked; its visibility is then 1 or 0. Every other tile casts the full
// `samples` and forgets its first rays: there the mask has the same bits as without `adaptive`. What can go wrong: a shadow or a gap that
// no first ray of a tile and its neighbours has met.
#include "trace/tracer.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <penumbra/error.hpp>

#include "scene/parallel.hpp"
#include "scene/stop.hpp"
#include "trace/embree_scene.hpp"
#include "trace/light_samples.hpp"
#include "trace/surface.hpp"

namespace penumbra {
namespace {

constexpr int tile = 4;
constexpr std::size_t pixels_together = 64;
constexpr int followed_step = 16; // receivers whose rays are followed to their end: one of so many each way

// What a light's texture weighs: nearest texel, constant over the texel, so that sums over texels are exact.
class Emission {
public:
    explicit Emission(const Image& image) : image_(image)
    {
        // A channel of one value weighs nothing: the same bits as without a texture.
        for (int c = 0; c < 3; ++c) {
            const int from = image.channels == 1 ? 0 : c;
            for (int y = 0; y < image.height; ++y)
                for (int x = 0; x < image.width; ++x) varies_[c] |= image.at(x, y, from) != image.at(0, 0, from);
        }
    }

    bool varies(int channel) const { return varies_[channel]; }

    // x and y in [-1, 1]: -1 is the left column (-u), the bottom row (-v).
    double at(float x, float y, int channel) const
    {
        const int column = std::clamp(static_cast<int>((static_cast<double>(x) + 1) / 2 * image_.width), 0, image_.width - 1);
        const int row = std::clamp(static_cast<int>((1 - static_cast<double>(y)) / 2 * image_.height), 0, image_.height - 1);
        return image_.at(column, row, image_.channels == 1 ? 0 : channel);
    }

private:
    const Image& image_;
    bool varies_[3] = {};
};

// A light in traced space, as receivers sample it.
struct TracedLight {
    LightFrame frame; // world space
    Vec3 center;      // directional: towards the light, unit length
    Vec3 half_u, half_v;
    bool sphere = false;
    const Emission* emission = nullptr;

    bool coincident() const { return half_u == Vec3(0, 0, 0) && half_v == Vec3(0, 0, 0); }
};

struct Receiver {
    bool sees_light = false; // false: nothing there, or behind the light's plane
    Vec3 point;              // traced space
    std::size_t pixel = 0;
    bool followed = false; // its rays are followed to their end, for the report
    Vec3 normal{0, 0, 0}; // world space; 0: the light is not clipped
};

// A depth image among the casters, and the light as its camera sees it.
struct WalkedImage {
    const DepthImage* image;
    float own;                   // DepthLine::own
    Vec3 centre, half_u, half_v; // image camera's coordinates; the direction to a directional light
};

// What one receiver's rays met.
struct Tally {
    int rays = 0, free = 0;
    int certain = 0, unknown = 0, left = 0; // blocked whatever the backs of depth images are; only behind fronts; out of the image
    double sum[3] = {}, free_sum[3] = {}; // of emission, where the channel varies

    bool agree() const { return free == 0 || free == rays; }
};

// Two axes of length `radius` perpendicular to `axis`.
void disc_axes(const Vec3& axis, double radius, Vec3& half_u, Vec3& half_v)
{
    const Vec3 size(std::abs(axis.x), std::abs(axis.y), std::abs(axis.z));
    const Vec3 other = size.x <= size.y && size.x <= size.z ? Vec3(1, 0, 0) : size.y <= size.z ? Vec3(0, 1, 0) : Vec3(0, 0, 1);
    const Vec3 u = axis.cross(other).normalized();
    half_u = u * radius;
    half_v = axis.cross(u).normalized() * radius;
}

class Visibility {
public:
    Visibility(const Tracer::Impl& scene, const TracedLight& light, const DepthMap& receivers, const Camera& camera,
               const VisibilityOptions& options, const SeenScene& seen)
        : scene_(scene), light_(light), receivers_(receivers), camera_(camera), options_(options), seen_(seen)
    {
        if (seen.bounds) {
            result_.bound = {.width = receivers.width, .height = receivers.height, .channels = 2, .pixels = {}};
            result_.bound.pixels.assign(result_.bound.pixel_count() * 2, 1.f);
        }
        for (const auto& image : seen.images) {
            const Camera& to = image->camera;
            const LightFrame& frame = light.frame;
            images_.push_back({.image = image.get(),
                               .own = same_place(to, camera) ? DEPTH_OWN_PIXELS : DEPTH_OWN_PLANE,
                               .centre = frame.directional ? direction_from_world(to, -frame.direction) : camera_from_world(to, frame.origin),
                               .half_u = direction_from_world(to, frame.u * frame.half_u),
                               .half_v = direction_from_world(to, frame.v * frame.half_v)});
        }
        const bool some = !seen.pixels.empty();
        result_.visibility = {.width = some ? static_cast<int>(seen.pixels.size()) : receivers.width, .height = some ? 1 : receivers.height, .channels = light.emission ? 3 : 1, .pixels = {}};
        result_.visibility.pixels.assign(result_.visibility.pixel_count() * static_cast<std::size_t>(result_.visibility.channels), 1.f);
    }

    VisibilityResult trace()
    {
        const int samples = light_.coincident() ? 1 : options_.samples;
        if (!seen_.pixels.empty())
            cast_pixels(samples);
        else if (options_.adaptive && options_.first_samples < samples)
            adaptive(samples);
        else
            cast_tiles(samples, 0, {}, nullptr);
        result_.rays = rays_;
        result_.followed = followed_;
        result_.behind = behind_;
        result_.left = left_;
        scene_.check("rtcOccluded16");
        return std::move(result_);
    }

private:
    enum Met : std::uint8_t { nothing = 0, free = 1, blocked = 2, both = 3 };

    int tile_columns() const { return (receivers_.width + tile - 1) / tile; }
    int tile_rows() const { return (receivers_.height + tile - 1) / tile; }

    void adaptive(int samples)
    {
        const std::size_t tiles = static_cast<std::size_t>(tile_columns()) * static_cast<std::size_t>(tile_rows());
        std::vector<std::uint8_t> met(tiles, nothing);
        cast_tiles(options_.first_samples, 1, {}, &met);

        // Settled: this tile and the eight around it have met one thing only.
        std::vector<std::uint8_t> skip(tiles, 0);
        for (int row = 0; row < tile_rows(); ++row)
            for (int column = 0; column < tile_columns(); ++column) {
                std::uint8_t around = nothing;
                for (int y = std::max(row - 1, 0); y <= std::min(row + 1, tile_rows() - 1); ++y)
                    for (int x = std::max(column - 1, 0); x <= std::min(column + 1, tile_columns() - 1); ++x)
                        around |= met[tile_index(x, y)];
                skip[tile_index(column, row)] = around != both;
            }
        cast_tiles(samples, 0, skip, nullptr);
    }

    std::size_t tile_index(int column, int row) const
    {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(tile_columns()) + static_cast<std::size_t>(column);
    }

    // Casts `samples` rays from every receiver of the tiles that are not in `skip`; `pass` chooses their random numbers.
    void cast_tiles(int samples, std::uint32_t pass, const std::vector<std::uint8_t>& skip, std::vector<std::uint8_t>* met)
    {
        const Strata strata = make_strata(samples, light_.half_u == Vec3(0, 0, 0), light_.half_v == Vec3(0, 0, 0));
        parallel_for(tile_rows(), [&](int row) {
            NearSurfaces scratch;
            std::uint64_t rays = 0;
            for (int column = 0; column < tile_columns(); ++column) {
                if (!skip.empty() && skip[tile_index(column, row)]) continue;
                std::uint8_t seen = nothing;
                for (int y = row * tile; y < std::min((row + 1) * tile, receivers_.height); ++y)
                    for (int x = column * tile; x < std::min((column + 1) * tile, receivers_.width); ++x) {
                        check_stop();
                        const Receiver receiver = receiver_at(x, y, scratch);
                        if (!receiver.sees_light) continue;
                        const Tally tally = cast(receiver, strata, pixel_key(x, y, pass));
                        seen |=
                            static_cast<std::uint8_t>((tally.free > 0 ? free : nothing) | (tally.free < tally.rays ? blocked : nothing));
                        rays += static_cast<std::uint64_t>(tally.rays);
                        store(x, y, tally);
                        if (receiver.followed) count_followed(tally);
                    }
                if (met) (*met)[tile_index(column, row)] = seen;
            }
            rays_ += rays;
        });
    }

    // Casts `samples` rays from each of the pixels that are asked for: the same rays as in the whole image.
    void cast_pixels(int samples)
    {
        const Strata strata = make_strata(samples, light_.half_u == Vec3(0, 0, 0), light_.half_v == Vec3(0, 0, 0));
        const std::size_t count = seen_.pixels.size();
        parallel_for(static_cast<int>((count + pixels_together - 1) / pixels_together), [&](int group) {
            NearSurfaces scratch;
            std::uint64_t rays = 0;
            const std::size_t first = static_cast<std::size_t>(group) * pixels_together;
            for (std::size_t i = first; i < std::min(count, first + pixels_together); ++i) {
                check_stop();
                const int x = static_cast<int>(seen_.pixels[i] % static_cast<std::uint32_t>(receivers_.width)), y = static_cast<int>(seen_.pixels[i] / static_cast<std::uint32_t>(receivers_.width));
                const Receiver receiver = receiver_at(x, y, scratch);
                if (!receiver.sees_light) continue;
                const Tally tally = cast(receiver, strata, pixel_key(x, y, 0));
                rays += static_cast<std::uint64_t>(tally.rays);
                store(static_cast<int>(i), 0, tally);
                if (receiver.followed) count_followed(tally);
            }
            rays_ += rays;
        });
    }

    SampleKey pixel_key(int x, int y, std::uint32_t pass) const
    {
        return sample_key(options_.seed,
                          static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(receivers_.width) + static_cast<std::uint64_t>(x),
                          pass);
    }

    Receiver receiver_at(int x, int y, NearSurfaces& scratch) const
    {
        if (seen_.surface) return lifted_receiver(x, y);
        const double depth = receivers_.at(x, y);
        if (!std::isfinite(depth) || !(depth > 0)) return {};
        const Vec3 world = world_point(camera_, receivers_.width, receivers_.height, x + 0.5, y + 0.5, depth);
        if (!light_.frame.directional && light_from_world(light_.frame, world).z <= 0) return {};

        // Depth has been rounded to float32, and as often again by at most three operations that decoded it.
        const Vec3 ray = camera_.orthographic ? -camera_.frame.z * depth : world - camera_.frame.origin;
        const double depth_error = 4 * float_rounding * ray.length() * scene_.scale;
        return {.sees_light = true,
                .point = before_surfaces(scene_, scene_.traced_from_world(world), ray.normalized(), depth_error, scratch),
                .pixel = pixel_index(x, y)};
    }

    std::size_t pixel_index(int x, int y) const
    {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(receivers_.width) + static_cast<std::size_t>(x);
    }

    Receiver lifted_receiver(int x, int y) const
    {
        const std::size_t i = pixel_index(x, y);
        const DepthVector& p = seen_.surface->points[i];
        const DepthVector& n = seen_.surface->normals[i];
        if (!(p.z > 0)) return {};
        const Vec3 world = world_from_camera(camera_, Vec3(p.x, p.y, p.z));
        if (!light_.frame.directional && light_from_world(light_.frame, world).z <= 0) return {};
        return {.sees_light = true,
                .point = scene_.traced_from_world(world),
                .pixel = i,
                .followed = !images_.empty() && x % followed_step == followed_step / 2 && y % followed_step == followed_step / 2,
                .normal = world_from_camera(camera_, Vec3(n.x, n.y, n.z)) - camera_.frame.origin};
    }

    // What the rays of a packet meet in images beside what blocks them.
    struct Followed {
        bool crossed[packet] = {}, behind[packet] = {}, left[packet] = {};
    };

    // Marks the rays of a packet that an image blocks; with `followed` all the way, whatever blocks them.
    void walk(const Receiver& receiver, const float (&x)[packet], const float (&y)[packet], const int (&valid)[packet], float (&tfar)[packet],
              Followed* followed) const
    {
        const Vec3 world = receiver.point / scene_.scale + scene_.origin;
        for (const WalkedImage& walked : images_) {
            const DepthImage& image = *walked.image;
            const Vec3 start = camera_from_world(image.camera, world);
            Vec3 centre = walked.centre, half_u = walked.half_u, half_v = walked.half_v;
            if (!light_.frame.directional) centre -= start;
            if (light_.sphere && !light_.coincident()) disc_axes(centre.normalized(), half_u.length(), half_u, half_v);
            const DepthVector from{static_cast<float>(start.x), static_cast<float>(start.y), static_cast<float>(start.z)};
            for (int i = 0; i < packet; ++i) {
                if (!valid[i] || (tfar[i] < 0 && !followed)) continue;
                const Vec3 way = centre + half_u * static_cast<double>(x[i]) + half_v * static_cast<double>(y[i]);
                const DepthVector along{static_cast<float>(way.x), static_cast<float>(way.y), static_cast<float>(way.z)};
                const DepthLine line = depth_line(image.view, from, along, light_.frame.directional, walked.own);
                const DepthMet met = depth_walk(image.view, image.pixels.data(), image.nearest.data(), DEPTH_LEVELS, line, followed != nullptr, 0);
                if (met.blocked) tfar[i] = -std::numeric_limits<float>::infinity();
                if (!followed) continue;
                followed->crossed[i] |= met.crossed != 0 && met.blocked != 0;
                followed->behind[i] |= met.behind != 0 || met.crossed != 0;
                followed->left[i] |= met.left != 0;
            }
        }
    }

    void count_followed(const Tally& tally)
    {
        followed_ += static_cast<std::uint64_t>(tally.rays);
        behind_ += static_cast<std::uint64_t>(tally.unknown);
        left_ += static_cast<std::uint64_t>(tally.left);
    }

    Tally cast(const Receiver& receiver, const Strata& strata, SampleKey key) const;
    void store(int x, int y, const Tally& tally);

    const Tracer::Impl& scene_;
    const TracedLight& light_;
    const DepthMap& receivers_;
    const Camera& camera_;
    const VisibilityOptions& options_;
    const SeenScene& seen_;
    std::vector<WalkedImage> images_;
    VisibilityResult result_;
    std::atomic<std::uint64_t> rays_{0}, followed_{0}, behind_{0}, left_{0};
};

void check_castable(const Imath::V3f& v)
{
    if (castable(v)) return;
    throw Error(ErrorCode::invalid_input, "a ray cannot be cast: it starts at, or goes by, a length beyond 1e18 or none at all",
                "expected lights, cameras and depth of lengths up to 1e12");
}

Tally Visibility::cast(const Receiver& receiver, const Strata& strata, SampleKey key) const
{
    // The ray's origin is the point in float32; its direction ends at the light, so that 0 < t < 1 is between them. A sun is endless.
    const Imath::V3f origin(receiver.point);
    Vec3 to_center = light_.center, half_u = light_.half_u, half_v = light_.half_v;
    if (!light_.frame.directional) to_center -= Vec3(origin);
    if (light_.sphere && !light_.coincident()) disc_axes(to_center.normalized(), half_u.length(), half_u, half_v);
    const Imath::V3f c(to_center), u(half_u), v(half_v);
    for (const Imath::V3f& one : {origin, c, u, v}) check_castable(one);
    const float end = light_.frame.directional ? std::numeric_limits<float>::infinity() : 1.f;

    const Imath::V3f n(receiver.normal);
    const bool follow = seen_.bounds || receiver.followed;
    const bool clipped = receiver.normal != Vec3(0, 0, 0);
    alignas(64) RTCRay16 rays;
    alignas(64) int valid[packet];
    for (int i = 0; i < packet; ++i) {
        rays.org_x[i] = origin.x;
        rays.org_y[i] = origin.y;
        rays.org_z[i] = origin.z;
        rays.tnear[i] = 0;
        rays.time[i] = 0;
        rays.mask[i] = ~0u;
        rays.id[i] = 0;
        rays.flags[i] = 0;
    }
    // Without Embree's coherent flag. CPU time on the bunny with it: 1.8, 1.6, 1.3 and 0.97 times at 16, 64, 256 and 1024 samples. Without
    // it, packets of 8 take 1.1 to 1.2 times, streams of 16 single rays 1.3 to 1.4 times; flushing denormals gains nothing.
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;

    Tally tally;
    tally.rays = strata.count;
    for (int first = 0; first < strata.count; first += packet) {
        // Points on the light.
        float x[packet], y[packet];
        jittered(strata, first, key, x, y);
        if (light_.frame.shape == LightShape::disc) square_to_disc(x, y);

        // Rays to them.
        for (int i = 0; i < packet; ++i) {
            rays.dir_x[i] = c.x + x[i] * u.x + y[i] * v.x;
            rays.dir_y[i] = c.y + x[i] * u.y + y[i] * v.y;
            rays.dir_z[i] = c.z + x[i] * u.z + y[i] * v.z;
            rays.tfar[i] = end;
            valid[i] = first + i < strata.count ? -1 : 0;
        }
        // Below the receiver's own plane nothing shines.
        int cast[packet];
        for (int i = 0; i < packet; ++i) {
            const bool below = clipped && rays.dir_x[i] * n.x + rays.dir_y[i] * n.y + rays.dir_z[i] * n.z <= 0;
            cast[i] = below ? 0 : valid[i];
            if (below) rays.tfar[i] = -std::numeric_limits<float>::infinity();
        }
        if (!scene_.triangles.empty()) rtcOccluded16(cast, scene_.scene, &context, &rays);
        if (!images_.empty()) {
            Followed followed;
            int by_mesh[packet];
            for (int i = 0; i < packet; ++i) by_mesh[i] = valid[i] != 0 && rays.tfar[i] < 0;
            walk(receiver, x, y, cast, rays.tfar, follow ? &followed : nullptr);
            for (int i = 0; i < packet && follow; ++i) {
                const bool certain = by_mesh[i] || followed.crossed[i];
                tally.certain += valid[i] != 0 && certain;
                tally.unknown += valid[i] != 0 && !certain && followed.behind[i];
                tally.left += valid[i] != 0 && !certain && followed.left[i];
            }
        } else if (follow) {
            for (int i = 0; i < packet; ++i) tally.certain += valid[i] != 0 && rays.tfar[i] < 0;
        }

        // Embree marks a blocked ray with tfar = -infinity.
        for (int i = 0; i < packet; ++i) tally.free += valid[i] != 0 && rays.tfar[i] >= 0;
        if (!light_.emission) continue;
        for (int channel = 0; channel < 3; ++channel) {
            if (!light_.emission->varies(channel)) continue;
            for (int i = 0; i < packet && first + i < strata.count; ++i) {
                const double emitted = light_.emission->at(x[i], y[i], channel);
                tally.sum[channel] += emitted;
                if (rays.tfar[i] >= 0) tally.free_sum[channel] += emitted;
            }
        }
    }
    return tally;
}

void Visibility::store(int x, int y, const Tally& tally)
{
    if (seen_.bounds) {
        const auto rays = static_cast<float>(tally.rays);
        result_.bound.at(x, y, 0) = 1 - static_cast<float>(tally.certain + tally.unknown) / rays;
        result_.bound.at(x, y, 1) = 1 - static_cast<float>(tally.certain) / rays;
    }
    for (int c = 0; c < result_.visibility.channels; ++c) {
        // Samples that all met black texels weigh the same.
        const bool weighted = tally.sum[c] > 0;
        const double share = weighted ? tally.free_sum[c] / tally.sum[c] : static_cast<double>(tally.free) / tally.rays;
        result_.visibility.at(x, y, c) = static_cast<float>(share);
    }
}

void require(const VisibilityOptions& options, const DepthMap& receivers)
{
    if (options.samples < 1) throw Error(ErrorCode::usage, "samples: is " + std::to_string(options.samples), "expected at least 1");
    if (options.adaptive && options.first_samples < 1)
        throw Error(ErrorCode::usage, "first_samples: is " + std::to_string(options.first_samples), "expected at least 1");
    const bool sized = receivers.width >= 1 && receivers.height >= 1 &&
                       receivers.depth.size() == static_cast<std::size_t>(receivers.width) * static_cast<std::size_t>(receivers.height);
    if (!sized)
        throw Error::at(ErrorCode::usage, "receivers.depth",
                        "is " + std::to_string(receivers.width) + " x " + std::to_string(receivers.height) + " with " +
                            std::to_string(receivers.depth.size()) + " values",
                        "expected at least 1 x 1 and as many values as pixels");
}

} // namespace

VisibilityResult trace_visibility(const Tracer& tracer, const Light& light, const DepthMap& receivers, const Camera& camera,
                                  const VisibilityOptions& options, const SeenScene& seen)
{
    require(options, receivers);
    const Tracer::Impl& scene = tracer.impl();

    TracedLight traced;
    traced.frame = light_frame(light);
    const double length = traced.frame.directional ? 1 : scene.scale; // a sun's extents are tangents, not lengths
    traced.center = traced.frame.directional ? -traced.frame.direction : scene.traced_from_world(traced.frame.origin);
    traced.half_u = traced.frame.u * (traced.frame.half_u * length);
    traced.half_v = traced.frame.v * (traced.frame.half_v * length);
    traced.sphere = std::holds_alternative<SphereLight>(light);

    std::optional<Emission> emission;
    const auto* rectangle = std::get_if<RectangleLight>(&light);
    if (rectangle && rectangle->emission) traced.emission = &emission.emplace(*rectangle->emission);
    return Visibility(scene, traced, receivers, camera, options, seen).trace();
}

} // namespace penumbra
