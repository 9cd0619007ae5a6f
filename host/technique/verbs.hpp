// The verbs that a technique owns, and the small views of a scene that it is handed for them.
//
// A technique is a settings struct S of the variant Technique (penumbra/technique.hpp). Beside it stand these functions, found by overload:
//
//   TechniqueRow row(const S&)                                              its kind, keys and lights (table.hpp)
//   Needs needs(const S&)                                                   what prepare wants of the scene
//   PreparedS prepare(opencl::Work&, const Casting&, const S&, Findings&)   light and casters become state
//   void shade(opencl::Work&, const PreparedS&, const Receiving&, Shaded&)  state and receivers become visibility
//   std::vector<WorkAmount> work(const S&, const MaskShape&)                what a mask costs at the most, as its sizes tell
//   std::vector<opencl::Specialisation> specialisations(const S&, int lanes)
//                                       every program that masks with these settings launch on a device of so many lanes
//   DeviceBuffers device_buffers(const S&)                                  whether depth and mask may stay on the device
//
// One more for those whose row says textured_lights:
//
//   PreparedS with_emission(opencl::Work&, const PreparedS&, const Light&)  the same light under another emission
//
// And one for those that have keys which exclude each other:
//
//   void check_together(const S&)                                           throws invalid_input, whatever the light is
//
// techniques.hpp checks that each has them all.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <penumbra/error.hpp>
#include <penumbra/mask_job.hpp>
#include <penumbra/scene.hpp>

#include "depth_image/depth_image.hpp"
#include "opencl/work.hpp"
#include "scene/camera.hpp"
#include "silhouette/silhouette.hpp"
#include "technique/receiver_points.hpp"
#include "trace/tracer.hpp"

namespace penumbra {

// What a technique wants of a scene before it prepares.
struct Needs {
    // The light's own view of what casts: rendered from the objects that cast where the scene has no map.
    bool front = false, back = false;
    int layers = 0; // surfaces behind the front, at the most
    // Objects that cast. or_front: without any, the maps that the scene has do, of which front must be one.
    enum class Casters { unused, or_front, required };
    Casters casters = Casters::unused;
    // Casting::images: depth images that cast are traced as they are. Techniques that do not want them get the light's view of them instead.
    bool depth_images = false;
    // The light's view holds what receives as well, not only what casts on it.
    bool whole_view = false;
    // Receiving::from_light: what the light sees of the receivers. Their mask is then shaded whole.
    bool receivers_from_light = false;
    // Of maps that are rendered: samples along one side of texels in which something begins or ends (FineDepth); 0: none. Maps with more texels in all than
    // `fine_texels` go without.
    int fine = 0;
    double fine_texels = 0;
    // It knows the receivers' planes and leaves out what of the light lies below their horizons, sample by sample.
    bool clips_light = false;
    // What its maps show between a receiver and the light, and the receiver's own horizon, are all that darkens it.
    bool maps_tell_all = false;
    // Its penumbrae are not the light's, so that nothing tells receivers from their neighbours.
    bool every_receiver = false;
    // What computing fewer receivers may add to a pixel's error; 0: each is shaded.
    double tolerance = 0;
};

// Depth as the light sees it: planar, row-major, `width` x `height`, in one place or the other. What was not asked for may be missing.
struct LightDepth {
    Camera camera; // the light's own view
    int width = 0, height = 0;
    const DepthMap *front = nullptr, *back = nullptr;
    std::span<const DepthMap> layers;
    cl::Buffer device_front, device_back; // where the caller has it on the device already
};

// What the maps show as triangles, each map's sheets of texels: of the front and of further layers, and with `back` of the back.
std::vector<TriangleMesh> surfaces_of(const LightDepth& maps, bool back);

// What prepare is handed. Everything stays the caller's and lives as long as the call.
struct Casting {
    const Light& light;
    LightDepth depth;
    std::vector<const TriangleMesh*> meshes; // of the objects that cast, world space; none: the maps are all there is
    // How those triangles hang together, and a hierarchy of them for rays: built by whoever asks first, kept with the scene's geometry.
    std::function<std::shared_ptr<const Topology>()> topology;
    std::function<std::shared_ptr<const Tracer>()> tracer;
    // The depth images among the objects that cast, fitted (Needs::depth_images).
    std::vector<std::shared_ptr<const DepthImage>> images;
    // Whether a receiver may lie on what casts: false only where that is known.
    bool receivers_cast = true;
};

// What prepare has to say beside its state.
struct Findings {
    Camera view;      // the light's view that receivers are to come in; unused by rays
    int channels = 1; // of the visibility: 3 for a coloured texture
    std::vector<std::string> warnings, notes;
};

// Some pixels of an image of receivers, as an image of their own: row by row in their order, TILE_WIDTH a row, what is left of the last rows empty.
struct ChosenReceivers {
    std::span<const std::uint32_t> pixels;  // y width + x of the whole image
    const DepthMap& depth;                  // of the whole image
    const DepthSurface* surface;            // of the whole image, where it is somebody else's
    const std::vector<DepthVector>& points; // of the chosen, in the camera's coordinates; z = 0: none
};

// The receivers of one mask: the depth image of one camera, on the host or on the device.
struct Receiving {
    Camera camera;
    int width = 0, height = 0;
    const DepthMap* depth = nullptr;
    cl::Buffer device_depth;                                 // for techniques of the device, unless there are points
    const opencl::Buffer<DepthVector>* device_points = nullptr; // what is shaded where pixels' centres are not: lifted, or some pixels
    const DepthSurface* surface = nullptr; // what was fitted to `depth`, where it is somebody else's: lifted points and their normals
    // Where these are some pixels of an image. On the host, for techniques that work there: `depth` and `surface` are theirs, as a list. On the device:
    // device_depth, device_points, normals and depth are the whole image's, width and height the list's.
    const ChosenReceivers* chosen = nullptr;
    const PixelList* listed = nullptr;
    // Of each pixel's surface, towards the camera and in its coordinates; null: not known.
    const opencl::Buffer<DepthVector>* normals = nullptr;
    const Camera& view;      // Findings::view
    // Depth of the receivers in that view, resolution x resolution. Empty unless Needs asked for it.
    std::function<DepthMap(int resolution)> from_light;
};

// What shading counted. Zero where the work is only queued.
struct ShadeCounts {
    std::uint64_t pairs = 0;               // (texel, receiver) pairs evaluated; rays
    std::uint64_t receivers = 0;           // that are there
    std::uint64_t uncovered_receivers = 0; // that see part of the light past the occluder map's border
    // Of samples of the light that were followed through depth images, from some receivers of a grid: all, those that pass behind a seen
    // surface and never through one, those that leave the image.
    std::uint64_t followed = 0, behind = 0, left = 0;

    ShadeCounts& operator+=(const ShadeCounts& more)
    {
        pairs += more.pairs;
        receivers += more.receivers;
        uncovered_receivers += more.uncovered_receivers;
        followed += more.followed;
        behind += more.behind;
        left += more.left;
        return *this;
    }
};

// Where shade puts its result: into the buffer where it runs on the device, into the image where it runs on the host.
struct Shaded {
    cl::Buffer visibility; // [height][width][channels] float32
    Image image;
    ShadeCounts* counts = nullptr; // null: do not wait for the device to count
    // Where it is wanted: told what shading will take, before most of it is done and within a factor of ten (work_estimate.hpp). What it throws
    // ends the work.
    std::function<void(const WorkAmount&)> estimated = {};
    // Where it is wanted (a row's `bounds`): the lowest and the highest visibility that each receiver can have, two channels.
    Image* bound = nullptr;
};

// Receivers whose samples are followed to their end, for the report: one of so many each way.
constexpr int followed_grid = 16;

// The size of what a mask is made from.
struct MaskShape {
    struct Map {
        int width, height;
    };
    Map receivers{};
    std::vector<Map> occluders; // of each light
    double edges = 0;           // of all that casts, at the most
    bool bound = false;         // whether the bound is wanted, too
    double pixels() const { return static_cast<double>(receivers.width) * receivers.height; }
    double lights() const { return static_cast<double>(occluders.size()); }
};

// Why a technique cannot start from depth that is on the device, or leave a mask there; nothing: it can.
struct DeviceBuffers {
    std::optional<Error> prepare, shade;
};

// Receiver points, for a technique whose `program` has the kernel. The stage "receivers" is left running, but of a caller's own depth on the device.
// reach: ReceiverView::light_reach.
ReceiverPoints points_of(opencl::Work& work, const Receiving& receivers, const opencl::Specialisation& program, float reach = 0);
// The same with the receivers' planes, where their normals are known.
ReceiverPoints points_with_planes(opencl::Work& work, const Receiving& receivers, const opencl::Specialisation& program, float reach = 0);
ReceiverPoints points_of(opencl::Work& work, const DepthMap& depth, const Camera& camera, const Camera& view,
                         const opencl::Specialisation& program, float reach = 0);

} // namespace penumbra
