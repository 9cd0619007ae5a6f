#include <algorithm>
#include <cmath>

#include "io/image_io.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"
#include "scene/camera.hpp"
#include "scene/position_depth.hpp"

namespace penumbra {

namespace {

constexpr std::int64_t max_resolution = 65536;

struct Size {
    int width, height;
};

std::string text(const Size& size) { return std::to_string(size.width) + " x " + std::to_string(size.height); }

std::optional<Size> read_resolution(const JsonObject& section)
{
    const auto value = section.find("resolution");
    if (!value) return {};
    const std::vector<JsonValue> pair = value->elements();
    return Size{static_cast<int>(pair[0].number()), static_cast<int>(pair[1].number())};
}

// The camera's view through an image of this size, for radial depth; the errors speak of the image `file`.
Camera radial_view(const CameraSpec& camera, int width, int height, const std::string& file)
{
    if (const auto* pinhole = std::get_if<PinholeCamera>(&camera)) return pinhole_view(*pinhole, width, height);
    const LightCamera& light = std::get<LightCamera>(camera);
    if (light.half_extent)
        throw Error(ErrorCode::invalid_input, file + " is radial, but its camera is orthographic and has no centre", "encoding \"planar\"");
    if (!light.tan_half_fov)
        throw Error(ErrorCode::invalid_input, file + " is radial, and its camera's tan_half_fov is missing",
                    "give tan_half_fov: radial depth needs it");
    return {.frame = {}, .half_extent = *light.tan_half_fov};
}

// A pinhole's pixels are as wide as the image says.
void take_aspect(CameraSpec& camera, double pixel_aspect)
{
    if (auto* const pinhole = std::get_if<PinholeCamera>(&camera)) pinhole->pixel_aspect = pixel_aspect;
}

// Reads a file of either kind. Depth is decoded by `view`, the camera of all the samples, or without one by what `radial_view` finds.
class DepthReader {
public:
    DepthReader(const DepthFile& file, const MapEncoding& encoding, const Resources& resources) : file_(file), name_(file.name.text()), encoding_(encoding)
    {
        const Bytes bytes = load_bytes(file.name, resources);
        under(file.name, [&] {
            if (file.positions)
                planes_ = decode_positions(bytes, encoding.channel, name_, resources.max_samples(), encoding.part);
            else
                raw_ = decode_raw_depth(bytes, encoding.channel, name_, resources.max_samples(), encoding.part);
            if (!file.positions) return;
            raw_.width = planes_.width;
            raw_.height = planes_.height;
            raw_.type = planes_.type;
            raw_.frame = planes_.frame;
            raw_.pixel_aspect = planes_.pixel_aspect;
        });
    }

    RawDepth& raw() { return raw_; } // of positions without samples
    ImageFrame frame() const { return frame_of(raw_); }

    DepthMap decode(const Camera& view, std::vector<std::string>& warnings)
    {
        const std::size_t before = warnings.size();
        DepthMap map = under(file_.name, [&] {
            if (!file_.positions) return decode_depth(std::move(raw_), encoding_.depth, view.half_extent, name_, warnings, view.off_axis);
            const PositionImage image{.width = planes_.width, .height = planes_.height, .type = planes_.type, .samples = planes_.samples};
            return depth_of_positions(image, encoding_.depth, view, name_, warnings);
        });
        for (std::size_t i = before; i < warnings.size(); ++i) warnings[i] = file_.name.key() + ": " + warnings[i];
        return map;
    }

    std::string values() const
    {
        if (!file_.positions) return values_text(raw_);
        return values_text({.width = planes_.width, .height = planes_.height, .type = planes_.type, .samples = planes_.samples});
    }

private:
    const DepthFile& file_;
    std::string name_;
    const MapEncoding& encoding_;
    RawDepth raw_;
    RawPlanes planes_;
};

// The camera of the samples, of which the frame alone is what `camera` sees.
Camera view_of_samples(const Camera& camera, const RawDepth& raw)
{
    const ImageFrame frame = frame_of(raw);
    if (frame.x == 0 && frame.y == 0 && frame.width == raw.width && frame.height == raw.height) return camera;
    return part_of_view(camera, frame.width, frame.height, -frame.x, -frame.y, raw.width, raw.height);
}

bool is_bare(const DepthMap& map)
{
    return std::ranges::none_of(map.depth, [](float depth) { return std::isfinite(depth); });
}

// A position is one of the world: the camera must stand somewhere before there is light.
const PinholeCamera& placed(const CameraSpec& camera, const DepthFile& file)
{
    if (const auto* pinhole = std::get_if<PinholeCamera>(&camera)) return *pinhole;
    throw file.name.error(file.name.text() + " holds positions, and the camera is the light's", "expected a camera of kind \"pinhole\"");
}

// The map's frame alone, as depth has it already.
DepthMap cut(DepthMap map, const ImageFrame& frame)
{
    RawDepth samples = framed({.width = map.width, .height = map.height, .samples = std::move(map.depth), .frame = frame});
    for (float& depth : samples.samples)
        if (std::isnan(depth)) depth = nothing_there;
    map.width = samples.width;
    map.height = samples.height;
    map.depth = std::move(samples.samples);
    return map;
}

// Loads the maps of one section, whose sizes have to agree: with `resolution`, or else with the first map.
class MapLoader {
public:
    MapLoader(const JsonObject& section, CameraSpec& camera, const Resources& resources, std::vector<std::string>& warnings)
        : camera_(camera), resources_(resources), warnings_(warnings), size_(read_resolution(section))
    {
        if (size_) size_from_ = section.value().key() + ".resolution";
        if (const auto value = section.find("encoding")) encoding_ = parse_encoding(*value);
    }

    DepthMap load(const JsonValue& name, bool positions = false)
    {
        DepthMap map = load_depth({name, positions}, encoding_, camera_, resources_, warnings_);
        const Size own{map.width, map.height};
        if (!size_) {
            if (own.width > max_resolution || own.height > max_resolution)
                throw Error::at(ErrorCode::too_large, name.key(),
                                name.text() + " is " + text(own) + "; the limit is " + std::to_string(max_resolution) + " a side");
            size_ = own;
            size_from_ = name.key();
        } else if (own.width != size_->width || own.height != size_->height) {
            throw name.error(name.text() + " is " + text(own) + ", expected " + text(*size_) + " as in " + size_from_);
        }
        return map;
    }

    // A map that has to show something.
    DepthMap load_shown(const JsonValue& name, bool positions)
    {
        DepthMap map = load(name, positions);
        if (is_bare(map)) warnings_.push_back(nothing_in({name, positions}, encoding_, resources_));
        return map;
    }

    const std::optional<Size>& size() const { return size_; }

private:
    CameraSpec& camera_;
    const Resources& resources_;
    std::vector<std::string>& warnings_;
    MapEncoding encoding_;
    std::optional<Size> size_;
    std::string size_from_;
};

CameraSpec camera_of(const JsonObject& section, const Light& light)
{
    const auto value = section.find("camera");
    return value ? parse_camera(*value, light) : CameraSpec(LightCamera{});
}

} // namespace

Bytes load_bytes(const JsonValue& name, const Resources& resources)
{
    return under(name, [&] { return resources.bytes(name.text()); });
}

namespace {

std::vector<DepthAnchor> parse_anchors(const JsonValue& value, const JsonObject& encoding)
{
    for (const char* solved : {"scale", "shift"})
        if (encoding.has(solved)) throw value.error(std::string("stands beside ") + solved, "expected one of the two: anchors are what it is solved from");
    const auto& list = std::get<scene_file::List>(scene_file::key_of(scene_file::encoding(), "anchors").type);
    const std::size_t count = value.elements().size();
    if (count < list.low || count > list.high)
        throw value.error("has " + std::to_string(count) + " anchors", "expected " + std::to_string(list.low) + " to " + std::to_string(list.high));
    std::vector<DepthAnchor> anchors;
    for (const JsonValue& element : value.elements()) {
        const JsonObject section = checked(element, scene_file::anchor());
        const std::vector<double> pixel = section.need("pixel").numbers(2);
        constexpr double furthest = 1e6;
        for (const double place : pixel)
            if (!(std::abs(place) < furthest)) throw section.need("pixel").expected("a pixel of the image");
        anchors.push_back({static_cast<std::int64_t>(std::floor(pixel[0])), static_cast<std::int64_t>(std::floor(pixel[1])), section.need("depth").number()});
    }
    return anchors;
}

} // namespace

MapEncoding parse_encoding(const JsonValue& value)
{
    const std::size_t kind = JsonObject(value).has("kind") ? kind_index(value, scene_file::encoding()) : 0;
    const JsonObject section = checked(value, scene_file::encoding().forms[kind]);
    MapEncoding result;
    result.depth.kind = static_cast<EncodingKind>(kind);
    if (const auto near = section.find("near")) result.depth.near = near->number();
    if (const auto far = section.find("far")) result.depth.far = far->number();
    if (const auto scale = section.find("scale")) {
        result.depth.scale = scale->number();
        if (result.depth.scale == 0) throw scale->expected("a number that is not 0");
    }
    if (const auto shift = section.find("shift")) result.depth.shift = shift->number();
    if (const auto precision = section.find("precision")) result.depth.precision = precision->number();
    if (const auto empty = section.find("empty")) result.depth.empty = empty->number();
    if (const auto channel = section.find("channel")) result.channel = channel->text();
    if (const auto part = section.find("part")) {
        if (part->json().is_string())
            result.part = part->text();
        else
            result.part = static_cast<int>(part->number());
    }
    if (const auto anchors = section.find("anchors")) result.depth.anchors = parse_anchors(*anchors, section);
    return result;
}

DepthMap load_depth(const DepthFile& file, const MapEncoding& encoding, CameraSpec& camera, const Resources& resources,
                    std::vector<std::string>& warnings)
{
    DepthReader reader(file, encoding, resources);
    take_aspect(camera, reader.raw().pixel_aspect);
    const ImageFrame frame = reader.frame();
    if (file.positions) {
        const Camera view = pinhole_view(placed(camera, file), frame.width, frame.height);
        return cut(reader.decode(view_of_samples(view, reader.raw()), warnings), frame);
    }
    reader.raw() = framed(std::move(reader.raw()));
    const bool radial = encoding.depth.kind == EncodingKind::radial;
    const Camera view = radial ? under(file.name, [&] { return radial_view(camera, frame.width, frame.height, file.name.text()); }) : Camera{};
    return reader.decode(view, warnings);
}

SeenDepth load_whole_depth(const DepthFile& file, const MapEncoding& encoding, const JsonValue& camera, const Light& light, const Resources& resources,
                           std::vector<std::string>& warnings)
{
    CameraSpec spec = parse_camera(camera, light);
    DepthReader reader(file, encoding, resources);
    take_aspect(spec, reader.raw().pixel_aspect);
    const ImageFrame frame = reader.frame();
    if (file.positions) placed(spec, file);
    if (encoding.depth.kind == EncodingKind::radial) under(file.name, [&] { radial_view(spec, frame.width, frame.height, file.name.text()); });
    // There is nothing that a light's camera could be fitted to: this image is the object.
    const Camera view = view_of_samples(resolve_camera(spec, light, {}, frame.width, frame.height, camera.key()), reader.raw());
    SeenDepth seen{.map = reader.decode(view, warnings), .camera = view};
    if (is_bare(seen.map)) warnings.push_back(nothing_in(file, encoding, resources));
    return seen;
}

std::string nothing_in(const DepthFile& file, const MapEncoding& encoding, const Resources& resources)
{
    return file.name.key() + ": " + file.name.text() + " shows no surface: " + DepthReader(file, encoding, resources).values();
}

Occluders parse_occluders(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings)
{
    const JsonObject section = checked(value, scene_file::occluders());
    Occluders occluders;
    occluders.camera = camera_of(section, light);
    MapLoader loader(section, occluders.camera, resources, warnings);
    if (const auto depth = section.find("depth")) {
        if (depth->json().is_string()) throw depth->expected("an object with front, back, layers");
        const JsonObject maps = checked(*depth, scene_file::occluder_depth());
        if (const auto front = maps.find("front")) occluders.front = loader.load(*front);
        if (const auto back = maps.find("back")) occluders.back = loader.load(*back);
        if (const auto layers = maps.find("layers"))
            for (const JsonValue& layer : layers->elements()) occluders.layers.push_back(loader.load(layer));
    }
    if (loader.size()) {
        occluders.width = loader.size()->width;
        occluders.height = loader.size()->height;
    }
    return occluders;
}

Receivers parse_receivers(const JsonValue& value, const Light& light, const Resources& resources, std::vector<std::string>& warnings)
{
    const JsonObject section = checked(value, scene_file::receivers());
    Receivers receivers;
    receivers.camera = camera_of(section, light);
    MapLoader loader(section, receivers.camera, resources, warnings);
    const auto depth = section.find("depth"), position = section.find("position");
    if (depth && position) throw position->error("stands beside depth", "expected one of the two");
    if (depth) receivers.depth = loader.load_shown(*depth, false);
    if (position) receivers.depth = loader.load_shown(*position, true);
    if (loader.size()) {
        receivers.width = loader.size()->width;
        receivers.height = loader.size()->height;
    }
    return receivers;
}

} // namespace penumbra
