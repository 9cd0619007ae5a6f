#include "technique/receiver_points.hpp"

#include <cmath>

namespace penumbra {
namespace {

int padded(int size, int multiple) { return (size + multiple - 1) / multiple * multiple; }

} // namespace

opencl::Specialisation receivers_program() { return {"receivers.cl", {{"TILE_ROWS", std::to_string(tile_rows)}}}; }

ReceiverView receiver_view(const Camera& camera, int width, int height, const Camera& light_view, float reach)
{
    ReceiverView view{};

    // Light space has the light camera's x and y, and z along its view. A camera's own (x, y, depth) has z along the view, too. The
    // difference of origins is taken in double precision, so that scenes far from the world's origin keep their digits.
    const Frame& to = light_view.frame;
    const Frame& from = camera.frame;
    const Vec3 axes_to[3] = {to.x, to.y, -to.z};
    const Vec3 axes_from[3] = {from.x, from.y, -from.z};
    const Vec3 offset = from.origin - to.origin;
    for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column)
            view.light_from_camera[4 * row + column] = static_cast<float>(axes_to[row].dot(axes_from[column]));
        view.light_from_camera[4 * row + 3] = static_cast<float>(axes_to[row].dot(offset));
    }

    view.pixel_x = static_cast<float>(camera.half_extent.x / width);
    view.pixel_y = static_cast<float>(camera.half_extent.y / height);
    view.off_x = static_cast<float>(camera.off_axis.x);
    view.off_y = static_cast<float>(camera.off_axis.y);
    view.per_light_x = static_cast<float>(1 / light_view.half_extent.x);
    view.per_light_y = static_cast<float>(1 / light_view.half_extent.y);
    view.camera_orthographic = camera.orthographic;
    view.light_orthographic = light_view.orthographic;
    view.light_reach = reach;
    view.width = width;
    view.height = height;
    view.stride = padded(width, TILE_WIDTH);
    view.rows = padded(height, tile_rows);
    return view;
}

namespace {

// An orthographic view says nothing of what lies beside its middle: the whole width counts as distance.
ReceiverView with_precision(ReceiverView view, double precision)
{
    const auto& m = view.light_from_camera;
    const float beside = view.light_orthographic ? std::hypot(1 / view.per_light_x, 1 / view.per_light_y) : 0.F;
    view.depth_error = (static_cast<float>(precision) + 4 * 0x1p-24F) * (std::hypot(m[3], m[7], m[11]) + beside);
    return view;
}

ReceiverPoints room_for_points(opencl::Work& work, const ReceiverView& view, double precision)
{
    const std::size_t count = static_cast<std::size_t>(view.stride) * static_cast<std::size_t>(view.rows);
    return {.view = with_precision(view, precision),
            .precision = precision,
            .xi = work.buffer<float>(count, "receivers' xi"),
            .eta = work.buffer<float>(count, "receivers' eta"),
            .d = work.buffer<float>(count, "receivers' disparity"),
            .planes = {}};
}

} // namespace

ReceiverPoints lifted_receiver_points(opencl::Work& work, const ReceiverView& view, const opencl::Buffer<DepthVector>& lifted, double precision,
                                      const opencl::Specialisation& program)
{
    ReceiverPoints points = room_for_points(work, view, precision);
    work.launch(program, "receivers_from_points", {static_cast<std::size_t>(view.stride), static_cast<std::size_t>(view.rows)}, {16, 8},
                points.d.bytes() * 6, view, lifted, points.xi, points.eta, points.d);
    return points;
}

void add_planes(opencl::Work& work, ReceiverPoints& points, const opencl::Buffer<DepthVector>& normals, const opencl::Specialisation& program)
{
    const ReceiverView& view = points.view;
    points.planes = work.buffer<float>(3 * points.d.count(), "receivers' planes");
    points.has_planes = true;
    work.launch(program, "receiver_planes", {static_cast<std::size_t>(view.stride), static_cast<std::size_t>(view.rows)}, {16, 8},
                points.d.bytes() * 8, view, normals, points.xi, points.eta, points.d, points.planes);
}

ReceiverPoints receiver_points(opencl::Work& work, const ReceiverView& view, const cl::Buffer& depth, double precision,
                               const opencl::Specialisation& program)
{
    ReceiverPoints points = room_for_points(work, view, precision);
    work.launch(program, "receivers_from_depth", {static_cast<std::size_t>(view.stride), static_cast<std::size_t>(view.rows)}, {16, 8},
                points.d.bytes() * 4, view, depth, points.xi, points.eta, points.d);
    return points;
}

ReceiverPoints listed_receiver_points(opencl::Work& work, const ReceiverView& view, const PixelList& list, const ImageOnDevice& image, double precision,
                                      const opencl::Specialisation& program)
{
    ReceiverView of_list = view;
    of_list.width = of_list.stride = TILE_WIDTH;
    of_list.height = of_list.rows = list.rows();
    ReceiverPoints points = room_for_points(work, of_list, precision);
    points.is_list = true;
    points.has_planes = image.normals != nullptr;
    if (points.has_planes) points.planes = work.buffer<float>(3 * points.d.count(), "receivers' planes");
    work.launch(program, "receivers_of_pixels", {list.length(), 1}, {64, 1}, list.count() * 40, view, static_cast<cl_int>(list.count()), static_cast<cl_int>(list.length()), list.pixels,
                image.points ? cl::Buffer() : image.depth, image.points ? image.points->memory() : cl::Buffer(), image.normals ? image.normals->memory() : cl::Buffer(), points.xi, points.eta,
                points.d, points.planes);
    return points;
}

} // namespace penumbra
