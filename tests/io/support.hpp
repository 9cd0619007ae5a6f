// What the tests of this room share.
#pragma once

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <penumbra/error.hpp>

#include "io/image_io.hpp"
#include <penumbra/scene_file.hpp>

namespace penumbra::test {

inline std::vector<std::byte> bytes_of(std::string_view text)
{
    std::vector<std::byte> bytes(text.size());
    if (!text.empty()) std::memcpy(bytes.data(), text.data(), text.size());
    return bytes;
}

// A folder of the test's own, gone afterwards.
class Folder {
public:
    Folder() : path_(std::filesystem::temp_directory_path() / ("penumbra-io-" + std::to_string(::getpid())))
    {
        std::filesystem::create_directories(path_);
    }
    ~Folder() { std::filesystem::remove_all(path_); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;
    std::string operator/(const std::string& name) const { return (path_ / name).string(); }
    std::size_t files() const { return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {})); }

    std::string write(const std::string& name, std::string_view text) const
    {
        std::ofstream(path_ / name, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
        return *this / name;
    }

private:
    std::filesystem::path path_;
};

// The error that `act` throws; fails the test when it throws none.
inline Error error_of(const std::function<void()>& act)
{
    try {
        act();
    } catch (const Error& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "more than one line: " << error.what();
        return error;
    }
    ADD_FAILURE() << "nothing was thrown";
    return {ErrorCode::internal, "nothing was thrown"};
}

#define EXPECT_MENTIONS(error, part) EXPECT_NE(std::string((error).what()).find(part), std::string::npos) << "in: " << (error).what()

// Parts of a request, by name.
class MemoryResources : public Resources {
public:
    std::map<std::string, std::vector<std::byte>> parts;
    std::uint64_t limit = std::uint64_t{1} << 24;

    Bytes bytes(const std::string& name) const override
    {
        const auto found = parts.find(name);
        if (found == parts.end()) throw Error(ErrorCode::not_found, name + ": no such part");
        return Bytes(std::span(found->second));
    }
    std::string path(const std::string& name) const override { throw Error(ErrorCode::unsupported, name + ": meshes are not taken here"); }
    std::uint64_t max_samples() const override { return limit; }
};

// Different values in every sample, 0 and 1 among them.
inline Image ramp(int width, int height, int channels)
{
    Image image{width, height, channels, {}};
    image.pixels.resize(image.pixel_count() * static_cast<std::size_t>(channels));
    const std::size_t last = image.pixels.size() > 1 ? image.pixels.size() - 1 : 1;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i) / static_cast<float>(last);
    return image;
}

inline Image constant(int width, int height, float value)
{
    Image image{width, height, 1, {}};
    image.pixels.assign(image.pixel_count(), value);
    return image;
}

} // namespace penumbra::test
