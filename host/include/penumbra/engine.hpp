// The engine: one OpenCL device that computes masks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <penumbra/export.hpp>
#include <penumbra/image.hpp>
#include <penumbra/scene.hpp>
#include <penumbra/technique.hpp>

namespace penumbra {

// One step of the work. `ms` is wall time; `device_ms` the time of its kernels and copies by the device's own clock; `bytes` what its
// kernels and copies had to move at the least.
struct Stage {
    std::string name;
    double ms = 0;
    double device_ms = 0;
    std::uint64_t bytes = 0;
};

// What was done and what it cost. prepare_ms depends on light and occluders alone, shade_ms on the receivers; neither holds file reading
// and writing, rendering depth from meshes, or compiling kernels: those have stages of their own.
// How far a mask is off over its shadow (the pixels of Metrics' _shadow figures), measured at some of its pixels.
struct ErrorEstimate {
    double mean = 0;        // absolute
    double p99 = 0;         // that 99 % of the pixels keep
    std::size_t pixels = 0; // measured at
    std::string by;         // "rays": against 1024 and more at each; "maps of a third": by what a third of the occluder maps' resolution changes, which
                            // says nothing of surfaces that no map shows
};

struct Report {
    std::string technique;
    std::vector<std::pair<std::string, SettingValue>> settings;
    std::string device_name, device_driver;
    int width = 0, height = 0;
    double prepare_ms = 0, shade_ms = 0, total_ms = 0;
    std::vector<Stage> stages;
    std::uint64_t peak_device_bytes = 0;
    std::uint64_t pairs = 0; // (occluder texel, receiver) pairs evaluated; 0 where that means nothing
    std::uint64_t receivers = 0, receivers_shaded = 0; // with a tolerance: how many there are, and how many were computed; else 0
    std::optional<ErrorEstimate> error_estimate;       // where it was asked for and can be had: of one light's mask, not of several together
    std::vector<std::string> warnings;
    std::vector<std::string> notes; // what was built, where the technique has something to say about it
};

// Visibility of each receiver pixel, linear, 0 umbra to 1 fully lit; 1 channel, or 3 when the light is textured.
struct Mask {
    Image visibility;
    // The lowest and the highest visibility that each pixel can have, where depth images cast and what lies behind their surfaces is not
    // known: two channels. Where it was asked for; else empty.
    Image bound = {};
    Report report;
};

// One of the masks of a scene with several lights or a sequence.
struct NamedMask {
    std::string light; // its name; empty: of all lights together, or of the only one
    int frame = 0;     // from 1; 0: the scene has no sequence
    Mask mask;
};

// Takes the masks as they come.
using MaskSink = std::function<void(NamedMask&&)>;

struct DeviceInfo {
    int index = 0; // in the list that `penumbra info` prints
    std::string name, vendor, driver, version, platform, type;
    unsigned compute_units = 0;
    std::uint64_t global_bytes = 0, max_allocation_bytes = 0, local_bytes = 0;
    std::size_t max_work_group = 0;
    unsigned lanes = 0; // receivers a work-item owns (float vector width of our kernels)
};

// Every OpenCL device there is. Empty when there is none.
PENUMBRA_API std::vector<DeviceInfo> list_devices();

// Everything that depends on light and occluders alone, on the device. Cheap to copy; keeps its engine's device alive.
class PENUMBRA_API Prepared {
public:
    struct State;
    explicit Prepared(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    const State& state() const { return *state_; }

private:
    std::shared_ptr<const State> state_;
};

// The objects of a scene with the hierarchies that rays need, built when first asked for: for many lights, receivers or techniques over the
// same objects. Cheap to copy; safe to use from several threads at once.
class PENUMBRA_API Geometry {
public:
    // Hierarchies are kept in float32 relative to `near`, best the light's centre: what they say of a point is off by about 2^-24 of its
    // distance from there.
    explicit Geometry(std::vector<Object> objects, const Vec3& near = {0, 0, 0});

    const std::vector<Object>& objects() const;
    std::uint64_t bytes() const; // of triangles and of the hierarchies that were built so far

    struct State;
    explicit Geometry(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    const State& state() const { return *state_; }

private:
    std::shared_ptr<const State> state_;
};

// Receivers whose planar depth is already on the device: float32, row-major, width * height, +infinity or 0 where nothing is there.
struct DeviceReceivers {
    CameraSpec camera = LightCamera{};
    int width = 0, height = 0;
    cl_mem depth = nullptr;
};

// Occluder depth that is already on the device, laid out as in DeviceReceivers; `back` may be null.
struct DeviceOccluders {
    CameraSpec camera = LightCamera{};
    int width = 0, height = 0;
    cl_mem front = nullptr;
    cl_mem back = nullptr;
};

struct MaskJob;
struct MaskHooks;

// Safe to use from several threads at once. The device is opened when something first needs it; that throws device when none fits. What shades
// on the host (ray_traced), and rendering depth from meshes, do not: they work without one.
class PENUMBRA_API Engine {
public:
    Engine();                                        // the device that PENUMBRA_DEVICE selects; without it, the first one
    explicit Engine(const std::string& selector);    // an index, or a part of a device's name
    Engine(cl_context context, cl_device_id device); // the caller's own; retained
    ~Engine();
    Engine(Engine&&) noexcept;
    Engine& operator=(Engine&&) noexcept;

    const DeviceInfo& device() const; // opened, if it was not

    // Prepares and shades. Depth images that the technique needs and the scene lacks are rendered from its objects. With several lights the
    // mask of all together: in each channel the mean by weight, summed in double in the order of the lights; of three channels when one of
    // theirs is. Throws usage for a scene with a sequence.
    Mask mask(const Scene& scene) const; // by scene.technique
    Mask mask(const Scene& scene, const Technique& technique) const;

    // Every mask of a scene: for each frame one of each light, in order, and then that of all together; of a scene without `lights` one for
    // each frame. The lights share the objects' hierarchies, kept around the first light's centre, and the receivers' depth; the frames
    // share what does not depend on emission (with_emission). One mask after the other: what the sink does not keep is gone.
    std::vector<NamedMask> masks(const Scene& scene) const; // by scene.technique
    std::vector<NamedMask> masks(const Scene& scene, const Technique& technique) const;
    void masks(const Scene& scene, const Technique& technique, const MaskSink& sink) const;

    // The same run of a job, with hooks (mask_job.hpp): for each frame one mask of each light, and then that of all together where the scene
    // has a list of them.
    void masks(const MaskJob& job, const MaskHooks& hooks, const MaskSink& sink) const;
    // Prepares all the job's lights, for its keeper; of a sequence its first frame.
    void prepare(const MaskJob& job, const MaskHooks& hooks) const;

    // Prepared state may be shaded many times. The first form takes depth maps alone; ray_traced needs objects: the second or the third.
    // What the technique needs and `occluders` lack is rendered from the objects. A light's camera that is left to be fitted holds what casts on the
    // scene's receivers, or on `receivers`: flat ground with nothing behind it is left out. Without receivers ground is held too, and shading
    // receivers that lie behind ground that was left out warns.
    Prepared prepare(const Light& light, const Occluders& occluders, const Technique& technique) const;
    Prepared prepare(const Scene& scene, const Technique& technique) const;
    Prepared prepare(const Light& light, const Occluders& occluders, const Geometry& geometry, const Technique& technique,
                     const Receivers* receivers = nullptr) const;
    Prepared prepare(const Light& light, const DeviceOccluders& occluders, const Technique& technique) const;

    // The same light, a rectangle, with another emission: silhouettes, hierarchies and all else that does not depend on it are shared with
    // `prepared`; the masks have the bits of preparing anew. Throws what preparing throws where the technique takes no textured light.
    Prepared with_emission(const Prepared& prepared, const Image& emission) const;

    // bound: Mask::bound is wanted. Throws unsupported for a technique that has none (depth_trace and ray_traced have).
    Mask shade(const Prepared& prepared, const Receivers& receivers, bool bound = false) const;

    // Device buffer to device buffer: `visibility` is float32, width * height, row-major. Returns when the work is queued on `queue` (of
    // this engine's context and device, in order).
    void shade(const Prepared& prepared, const DeviceReceivers& receivers, cl_mem visibility, cl_command_queue queue) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

// The scene with every depth image that `technique` needs in place (rendered from the objects), all cameras resolved; of several lights
// each with occluders of its own.
PENUMBRA_API Scene with_depth(const Scene& scene, const Technique& technique);

// The receivers with their depth in place (rendered from the objects that receive where it is missing) and their camera resolved.
PENUMBRA_API Receivers with_depth(const Receivers& receivers, const Light& light, const Geometry& geometry);

// The report as `penumbra mask --report` writes it: JSON.
PENUMBRA_API std::string report_json(const Report& report);

// The reports of several masks as {"masks": [...]}: each as above, with `light` and `frame` (null where there is none) and `file` in front.
struct FileReport {
    std::string light; // as in NamedMask
    int frame = 0;
    std::string file;
    Report report;
};
PENUMBRA_API std::string reports_json(const std::vector<FileReport>& reports);

// The program's version, "1.2.3".
PENUMBRA_API std::string version();

} // namespace penumbra
