// Image files as other programs write them, by OpenImageIO itself.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "io/support.hpp"

namespace penumbra::test {

// Channels with their samples; all parts of one size.
struct MadePart {
    std::string name;
    std::vector<std::pair<std::string, std::vector<float>>> channels;
    std::function<void(OIIO::ImageSpec&)> adjust = [](OIIO::ImageSpec&) {};
};

struct MadeImage {
    int width = 0, height = 0;
    std::vector<MadePart> parts;
    std::string plugin = "openexr";
    OIIO::TypeDesc type = OIIO::TypeFloat;
};

inline OIIO::ImageSpec spec_of(const MadeImage& image, const MadePart& part)
{
    OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(part.channels.size()), image.type);
    spec.channelnames.clear();
    for (const auto& [name, samples] : part.channels) spec.channelnames.push_back(name);
    if (!part.name.empty()) spec.attribute("oiio:subimagename", part.name);
    part.adjust(spec);
    return spec;
}

inline std::vector<float> pixels_of(const MadePart& part)
{
    std::vector<float> pixels;
    for (std::size_t i = 0; i < part.channels.front().second.size(); ++i)
        for (const auto& [name, samples] : part.channels) pixels.push_back(samples[i]);
    return pixels;
}

// Samples are what is stored: integers are not scaled.
inline std::vector<std::byte> bytes_of(const MadeImage& image)
{
    const Folder folder;
    const std::string path = folder / ("made." + (image.plugin == "openexr" ? "exr" : image.plugin));
    const auto output = OIIO::ImageOutput::create(image.plugin);
    std::vector<OIIO::ImageSpec> specs;
    for (const MadePart& part : image.parts) specs.push_back(spec_of(image, part));
    const bool several = specs.size() > 1 && image.plugin == "openexr";
    EXPECT_TRUE(several ? output->open(path, static_cast<int>(specs.size()), specs.data()) : output->open(path, specs[0]))
        << output->geterror();
    for (std::size_t i = 0; i < specs.size(); ++i) {
        EXPECT_TRUE(i == 0 || output->open(path, specs[i], OIIO::ImageOutput::AppendSubimage)) << output->geterror();
        const std::vector<float> pixels = pixels_of(image.parts[i]);
        bool written = false;
        if (image.type == OIIO::TypeUInt16)
            written = output->write_image(OIIO::TypeUInt16, std::vector<std::uint16_t>(pixels.begin(), pixels.end()).data());
        else if (image.type == OIIO::TypeUInt8)
            written = output->write_image(OIIO::TypeUInt8, std::vector<std::uint8_t>(pixels.begin(), pixels.end()).data());
        else
            written = output->write_image(OIIO::TypeFloat, pixels.data());
        EXPECT_TRUE(written) << output->geterror();
    }
    EXPECT_TRUE(output->close()) << output->geterror();
    return read_file(path, path);
}

} // namespace penumbra::test
