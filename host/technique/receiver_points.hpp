// Receivers as light-space points on the device: what every technique shades.
#pragma once

#include <penumbra/scene.hpp>

#include "common/depth_walk.h"
#include "common/shared.h"
#include "opencl/work.hpp"

namespace penumbra {

// Rows of a tile of receivers (see soft_shadow_map.cl; the width is TILE_WIDTH of common/shared.h).
constexpr int tile_rows = 8;

// The program of receivers.cl by itself. A technique's kernel file includes it and occluders.cl, and the technique launches all it needs
// from its own program: drivers take tens of milliseconds a program even from their caches.
opencl::Specialisation receivers_program();

// Padded lists, `view.rows` x `view.stride`.
struct ReceiverPoints {
    ReceiverView view{};
    double precision = 0; // of the depth they came from, relative
    opencl::Buffer<float> xi, eta, d;
    opencl::Buffer<float> planes; // of each receiver's own surface, [3][rows][stride] (common/receiver_plane.clh); none: not known
    bool has_planes = false;
    bool is_list = false; // neighbours of a row lie together, rows need not
};

// The transform from `camera` to the space of the light's own view. reach: ReceiverView::light_reach.
ReceiverView receiver_view(const Camera& camera, int width, int height, const Camera& light_view, float reach = 0);

// Launches receivers_from_depth on a depth map that is on the device. `program`: one that has the kernel.
ReceiverPoints receiver_points(opencl::Work& work, const ReceiverView& view, const cl::Buffer& depth, double precision,
                               const opencl::Specialisation& program = receivers_program());

// The same of points in the camera's coordinates, [view.height][view.width]; z = 0: no receiver.
ReceiverPoints lifted_receiver_points(opencl::Work& work, const ReceiverView& view, const opencl::Buffer<DepthVector>& lifted, double precision,
                                      const opencl::Specialisation& program = receivers_program());

// Some pixels of an image on the device, as a list of its own: TILE_WIDTH a row, rows of whole tiles, what is left of the last ones empty.
struct PixelList {
    const opencl::Buffer<cl_uint>& pixels; // y width + x
    int width, height;                     // of the whole image

    std::size_t count() const { return pixels.count(); }
    int rows() const { return static_cast<int>((count() + TILE_WIDTH * tile_rows - 1) / (TILE_WIDTH * tile_rows)) * tile_rows; }
    std::size_t length() const { return static_cast<std::size_t>(rows()) * TILE_WIDTH; }
};

// What an image of receivers has on the device: depth or, where there are some, points; normals, null where planes are not known.
struct ImageOnDevice {
    cl::Buffer depth;
    const opencl::Buffer<DepthVector>*points = nullptr, *normals = nullptr;
};

// The points, with their planes, of the pixels of an image. `view`: of the whole image.
ReceiverPoints listed_receiver_points(opencl::Work& work, const ReceiverView& view, const PixelList& list, const ImageOnDevice& image, double precision,
                                      const opencl::Specialisation& program);

// Gives the points their planes. `normals`: of their surfaces, towards the camera, in its coordinates, [view.height][view.width].
void add_planes(opencl::Work& work, ReceiverPoints& points, const opencl::Buffer<DepthVector>& normals, const opencl::Specialisation& program = receivers_program());

} // namespace penumbra
