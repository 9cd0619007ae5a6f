#include "io/image_io.hpp"
#include "io/scene_check.hpp"
#include "io/scene_parts.hpp"

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

// The tangents of the half angles, which radial depth is turned into planar depth by; the errors speak of the image `file`.
Vec2 tangents(const CameraSpec& camera, int width, int height, const std::string& file)
{
    if (const auto* pinhole = std::get_if<PinholeCamera>(&camera)) {
        const Vec2 t = pinhole->tan_half_fov;
        return {t.x != 0 ? t.x : t.y * width / height, t.y};
    }
    const LightCamera& light = std::get<LightCamera>(camera);
    if (light.half_extent)
        throw Error(ErrorCode::invalid_input, file + " is radial, but its camera is orthographic and has no centre", "encoding \"planar\"");
    if (!light.tan_half_fov)
        throw Error(ErrorCode::invalid_input, file + " is radial, and its camera's tan_half_fov is missing",
                    "give tan_half_fov: radial depth needs it");
    return *light.tan_half_fov;
}

// Loads the maps of one section, whose sizes have to agree: with `resolution`, or else with the first map.
class MapLoader {
public:
    MapLoader(const JsonObject& section, const CameraSpec& camera, const Resources& resources, std::vector<std::string>& warnings)
        : camera_(camera), resources_(resources), warnings_(warnings), size_(read_resolution(section))
    {
        if (size_) size_from_ = section.value().key() + ".resolution";
        if (const auto value = section.find("encoding")) encoding_ = parse_encoding(*value);
    }

    DepthMap load(const JsonValue& name)
    {
        DepthMap map = load_depth(name, encoding_, camera_, resources_, warnings_);
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

    const std::optional<Size>& size() const { return size_; }

private:
    const CameraSpec& camera_;
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

MapEncoding parse_encoding(const JsonValue& value)
{
    const std::size_t kind = kind_index(value, scene_file::encoding());
    const JsonObject section = checked(value, scene_file::encoding().forms[kind]);
    MapEncoding result;
    result.depth.kind = static_cast<EncodingKind>(kind);
    if (const auto near = section.find("near")) result.depth.near = near->number();
    if (const auto far = section.find("far")) result.depth.far = far->number();
    if (const auto scale = section.find("scale")) result.depth.scale = scale->number();
    if (const auto shift = section.find("shift")) result.depth.shift = shift->number();
    if (const auto precision = section.find("precision")) result.depth.precision = precision->number();
    if (const auto empty = section.find("empty")) result.depth.empty = empty->number();
    if (const auto channel = section.find("channel")) result.channel = channel->text();
    return result;
}

DepthMap load_depth(const JsonValue& name, const MapEncoding& encoding, const CameraSpec& camera, const Resources& resources,
                    std::vector<std::string>& warnings)
{
    const std::string file = name.text();
    const Bytes bytes = load_bytes(name, resources);
    const std::size_t before = warnings.size();
    DepthMap map = under(name, [&] {
        RawDepth raw = decode_raw_depth(bytes, encoding.channel, file, resources.max_samples());
        const Vec2 half = encoding.depth.kind == EncodingKind::radial ? tangents(camera, raw.width, raw.height, file) : Vec2(1, 1);
        return decode_depth(std::move(raw), encoding.depth, half, file, warnings);
    });
    for (std::size_t i = before; i < warnings.size(); ++i) warnings[i] = name.key() + ": " + warnings[i];
    return map;
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
    if (const auto depth = section.find("depth")) receivers.depth = loader.load(*depth);
    if (loader.size()) {
        receivers.width = loader.size()->width;
        receivers.height = loader.size()->height;
    }
    return receivers;
}

} // namespace penumbra
