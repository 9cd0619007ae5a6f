#include "io/obj.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/cut_image.hpp"
#include "io/words.hpp"

namespace penumbra {

namespace {

class Reader {
public:
    Reader(std::string_view text, const MeshSource& source) : rest_(without_byte_order_mark(text)), source_(source) {}

    PolygonSoup read()
    {
        std::string joined;
        for (std::string_view line; next_line(line, joined);) {
            const std::string_view key = next_word(line);
            if (key == "v")
                read_vertex(line);
            else if (key == "vt")
                read_texture(line);
            else if (key == "f")
                read_polygon(line);
            else if (key == "l" || key == "p")
                ++soup_.lines;
            else if (key == "usemtl")
                use_material(line);
            else if (key == "mtllib")
                read_library(line);
        }
        return std::move(soup_);
    }

private:
    Error fail(const std::string& what) const { return broken_mesh(source_.where, "line " + std::to_string(number_) + " " + what); }

    // The next line, with those that a backslash at its end joins to it in `joined`.
    bool next_line(std::string_view& line, std::string& joined)
    {
        if (rest_.empty()) return false;
        line = text_line();
        if (!line.ends_with('\\')) return true;
        joined.clear();
        for (; line.ends_with('\\') && !rest_.empty(); line = text_line()) joined.append(line.substr(0, line.size() - 1)).push_back(' ');
        joined.append(line);
        line = joined;
        return true;
    }
    std::string_view text_line()
    {
        ++number_;
        const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
        const std::string_view line = rest_.substr(0, end);
        const bool both = rest_.substr(end).starts_with("\r\n");
        rest_.remove_prefix(std::min(end + (both ? 2 : 1), rest_.size()));
        return line.substr(0, line.find('#')); // comments may stand behind
    }

    void read_vertex(std::string_view line)
    {
        std::array<double, 4> numbers{0, 0, 0, 1};
        std::size_t count = 0;
        for (std::string_view word = next_word(line); !word.empty(); word = next_word(line), ++count) {
            const auto number = number_of(word);
            if (!number && count < 3) break;
            if (number && count < 4) numbers[count] = *number;
        }
        if (count < 3) throw fail("has a vertex without three numbers");
        const double w = count == 4 && numbers[3] != 0 ? numbers[3] : 1; // homogeneous; six numbers are a place and a colour
        soup_.positions.emplace_back(numbers[0] / w, numbers[1] / w, numbers[2] / w);
    }

    // v goes up in OBJ.
    void read_texture(std::string_view line)
    {
        const double u = number_of(next_word(line)).value_or(0), v = number_of(next_word(line)).value_or(0);
        texture_.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }

    // "7", "7/3", "7//2": the number before the first slash, or after it.
    std::uint32_t index(std::string_view word, std::size_t count, const char* what) const
    {
        std::int64_t index = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
        const auto all = static_cast<std::int64_t>(count);
        const std::int64_t from_0 = index < 0 ? all + index : index - 1;
        if (error != std::errc() || end != word.data() + word.size())
            throw fail(std::string("has a face with ") + what + " " + in_quotes(word));
        if (from_0 < 0 || from_0 >= all)
            throw fail(std::string("has a face with ") + what + " " + std::to_string(index) + " of " + std::to_string(count));
        return static_cast<std::uint32_t>(from_0);
    }

    void read_polygon(std::string_view line)
    {
        corners_.clear();
        mapped_.clear();
        bool textured = cut_ != not_cut;
        for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
            const std::size_t slash = std::min(word.find('/'), word.size());
            corners_.push_back(index(word.substr(0, slash), soup_.positions.size(), "vertex"));
            if (!textured) continue;
            const std::string_view second = word.substr(std::min(slash + 1, word.size()));
            const std::string_view vt = second.substr(0, second.find('/'));
            textured = !vt.empty();
            if (textured) mapped_.push_back(mapped(texture_[index(vt, texture_.size(), "texture coordinate")]));
        }
        soup_.add(corners_, textured ? cut_ : not_cut, mapped_);
    }

    // From OBJ's coordinates to those of the image of the material in use.
    Imath::V2f mapped(const Imath::V2f& at) const
    {
        const Imath::V2f p = at * map_->scale + map_->offset;
        return {p.x, 1 - p.y};
    }

    void use_material(std::string_view line)
    {
        while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
        while (!line.empty() && is_space(line.back())) line.remove_suffix(1);
        const auto found = materials_.find(line);
        map_ = found == materials_.end() ? nullptr : &found->second;
        cut_ = map_ ? cut_of(found->first, *map_) : not_cut;
    }

    // The cut-out of a material, read when it is first used.
    std::uint32_t cut_of(const std::string& material, const OpacityMap& map)
    {
        const auto [known, is_new] = cuts_.emplace(material, not_cut);
        if (!is_new) return known->second;
        const AlphaOf from = map.channel == 'm' ? AlphaOf::alpha : map.channel == 0 ? AlphaOf::either : AlphaOf::colour;
        CutOut cut{.alpha = {}, .cutoff = 0.5f};
        if (map.clamp) cut.beyond_u = cut.beyond_v = CutOut::Beyond::clamp;
        std::optional<Image> alpha;
        try {
            alpha = cut_image(source_.companion(map.file), map.file, from, source_.max_samples);
        } catch (const Error& error) {
            if (error.code() != ErrorCode::not_found) throw;
            source_.warn("names " + in_quotes(map.file) + " as map_d, which is not there: nothing is cut out");
        }
        if (!alpha) return not_cut;
        cut.alpha = std::move(*alpha);
        if (cuts_nothing(cut)) return not_cut;
        soup_.cuts.push_back(std::move(cut));
        return known->second = static_cast<std::uint32_t>(soup_.cuts.size() - 1);
    }

    // One name with spaces, or several names.
    void read_library(std::string_view line)
    {
        while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
        while (!line.empty() && is_space(line.back())) line.remove_suffix(1);
        if (line.empty() || !source_.companion || read_one_library(line)) return;
        bool any = false;
        for (std::string_view names = line, name = next_word(names); !name.empty(); name = next_word(names)) any |= read_one_library(name);
        if (!any) source_.warn("names the materials of " + in_quotes(line) + ", which is not there: nothing is cut out");
    }
    bool read_one_library(std::string_view name)
    {
        try {
            const Bytes bytes = source_.companion(std::string(name));
            const std::span<const std::byte> view = bytes;
            materials_.merge(opacity_maps({reinterpret_cast<const char*>(view.data()), view.size()}));
            return true;
        } catch (const Error& error) {
            if (error.code() != ErrorCode::not_found) throw;
            return false;
        }
    }

    std::string_view rest_;
    const MeshSource& source_;
    std::size_t number_ = 0;
    PolygonSoup soup_;
    std::vector<Imath::V2f> texture_;
    std::map<std::string, OpacityMap, std::less<>> materials_;
    std::map<std::string, std::uint32_t> cuts_;
    const OpacityMap* map_ = nullptr; // of the material in use
    std::uint32_t cut_ = not_cut;
    std::vector<std::uint32_t> corners_;
    std::vector<Imath::V2f> mapped_;
};

} // namespace

PolygonSoup decode_obj(std::span<const std::byte> bytes, const MeshSource& source)
{
    return Reader({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, source).read();
}

} // namespace penumbra
