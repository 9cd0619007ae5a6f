#include "io/gltf_accessor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace penumbra {

namespace {

// Of elements that no bytes stand for: zeros, as sparse accessors may have them.
constexpr std::size_t most_zeros = std::size_t{16} << 20;

enum class Component { int8 = 5120, uint8, int16, uint16, uint32 = 5125, float32 };

std::size_t size_of(Component type)
{
    switch (type) {
    case Component::int8:
    case Component::uint8:
        return 1;
    case Component::int16:
    case Component::uint16:
        return 2;
    default:
        return 4;
    }
}

double number_at(std::span<const std::byte> bytes, Component type)
{
    std::uint32_t bits = 0;
    for (std::size_t i = size_of(type); i-- > 0;) bits = bits << 8 | std::to_integer<std::uint32_t>(bytes[i]);
    switch (type) {
    case Component::int8:
        return static_cast<std::int8_t>(bits);
    case Component::int16:
        return static_cast<std::int16_t>(bits);
    case Component::float32:
        return std::bit_cast<float>(bits);
    default:
        return bits;
    }
}

// What a normalised integer is divided by.
double range_of(Component type)
{
    switch (type) {
    case Component::int8:
        return 127;
    case Component::uint8:
        return 255;
    case Component::int16:
        return 32767;
    case Component::uint16:
        return 65535;
    case Component::uint32:
        return 4294967295.0;
    case Component::float32:
        break;
    }
    return 1;
}

int width_of(int type)
{
    switch (type) {
    case TINYGLTF_TYPE_SCALAR:
        return 1;
    case TINYGLTF_TYPE_VEC2:
        return 2;
    case TINYGLTF_TYPE_VEC3:
        return 3;
    case TINYGLTF_TYPE_VEC4:
        return 4;
    case TINYGLTF_TYPE_MAT4:
        return 16;
    default:
        return 0; // 2 x 2 and 3 x 3 matrices stand nowhere that matters
    }
}

class AccessorReader {
public:
    AccessorReader(const GltfFile& file, int index)
        : file_(file), accessor_(file.entry(file.model.accessors, index, "accessors")), name_("accessors[" + std::to_string(index) + "]")
    {
    }

    std::vector<double> read(int width)
    {
        if (width_of(accessor_.type) != width)
            throw fail("has " + std::to_string(width_of(accessor_.type)) + " numbers an element, expected " + std::to_string(width));
        width_ = static_cast<std::size_t>(width);
        type_ = component(accessor_.componentType);
        if (accessor_.bufferView < 0 && accessor_.count > most_zeros)
            throw fail("has " + std::to_string(accessor_.count) + " elements and no bufferView");
        std::vector<double> numbers;
        if (accessor_.bufferView >= 0) {
            const std::size_t stride = file_.entry(file_.model.bufferViews, accessor_.bufferView, "bufferViews").byteStride;
            numbers = elements(accessor_.bufferView, accessor_.byteOffset, stride, accessor_.count, type_, width_);
        } else {
            numbers.assign(accessor_.count * width_, 0.0);
        }
        if (accessor_.sparse.isSparse) replace(numbers);
        if (accessor_.normalized && type_ != Component::float32)
            for (double& number : numbers) number = std::max(number / range_of(type_), -1.0);
        return numbers;
    }

private:
    Error fail(const std::string& what) const { return file_.broken("has " + name_ + " that " + what); }

    Component component(int type) const
    {
        if ((type < 5120 || type > 5123) && type != 5125 && type != 5126)
            throw fail("has the unknown componentType " + std::to_string(type));
        return static_cast<Component>(type);
    }

    std::vector<double> elements(int view, std::size_t offset, std::size_t stride, std::size_t count, Component type,
                                 std::size_t width) const
    {
        const std::span<const std::byte> bytes = view_bytes(file_, view);
        const std::size_t step = size_of(type), element = step * width;
        if (stride == 0) stride = element;
        if (stride < element) throw fail("has elements of " + std::to_string(element) + " bytes, " + std::to_string(stride) + " apart");
        // offset + stride (count - 1) + element <= size, without overflow
        const bool fits = count == 0 || (offset <= bytes.size() && element <= bytes.size() - offset &&
                                         count - 1 <= (bytes.size() - offset - element) / stride);
        if (!fits)
            throw fail("reaches beyond its bufferViews[" + std::to_string(view) + "] of " + std::to_string(bytes.size()) + " bytes: " +
                       std::to_string(count) + " elements of " + std::to_string(element) + " bytes from " + std::to_string(offset));
        std::vector<double> numbers;
        numbers.reserve(count * width);
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < width; ++k) numbers.push_back(number_at(bytes.subspan(offset + i * stride + k * step, step), type));
        return numbers;
    }

    void replace(std::vector<double>& numbers) const
    {
        const auto& sparse = accessor_.sparse;
        if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0) throw fail("has negative numbers in sparse");
        const auto count = static_cast<std::size_t>(sparse.count);
        const Component type = component(sparse.indices.componentType);
        if (type != Component::uint8 && type != Component::uint16 && type != Component::uint32)
            throw fail("has sparse indices that are signed");
        const std::vector<double> at =
            elements(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), 0, count, type, 1);
        const std::vector<double> values =
            elements(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), 0, count, type_, width_);
        for (std::size_t i = 0; i < count; ++i) {
            const auto place = static_cast<std::size_t>(at[i]);
            if (place >= accessor_.count)
                throw fail("replaces element " + std::to_string(place) + " of " + std::to_string(accessor_.count) + " (sparse)");
            std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(i * width_), width_,
                        numbers.begin() + static_cast<std::ptrdiff_t>(place * width_));
        }
    }

    const GltfFile& file_;
    const tinygltf::Accessor& accessor_;
    std::string name_;
    Component type_ = Component::float32;
    std::size_t width_ = 1;
};

} // namespace

std::vector<double> read_numbers(const GltfFile& file, int accessor, int width) { return AccessorReader(file, accessor).read(width); }

std::vector<std::uint32_t> read_indices(const GltfFile& file, int accessor)
{
    const int type = file.entry(file.model.accessors, accessor, "accessors").componentType;
    if (type != 5121 && type != 5123 && type != 5125)
        throw file.broken("has indices of componentType " + std::to_string(type) + ", expected unsigned integers");
    const std::vector<double> numbers = read_numbers(file, accessor, 1);
    std::vector<std::uint32_t> indices(numbers.size());
    std::ranges::transform(numbers, indices.begin(), [](double number) { return static_cast<std::uint32_t>(number); });
    return indices;
}

std::size_t element_count(const GltfFile& file, int accessor) { return file.entry(file.model.accessors, accessor, "accessors").count; }

} // namespace penumbra
