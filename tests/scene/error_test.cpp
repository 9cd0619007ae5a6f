// An error's parts, and the line that they make.
#include <gtest/gtest.h>

#include <penumbra/error.hpp>
#include <penumbra/scene.hpp>

#include "scene/lights.hpp"

namespace penumbra {
namespace {

const Error plain(ErrorCode::usage, "went wrong", "expected better");
const Error at_key = Error::at(ErrorCode::invalid_input, "light.half_u", "is missing");

TEST(Error, TheLineJoinsWhatThereIs)
{
    EXPECT_STREQ(plain.what(), "went wrong (expected better)");
    EXPECT_STREQ(at_key.what(), "light.half_u: is missing");
    EXPECT_STREQ(at_key.within("scene.json").what(), "scene.json: light.half_u: is missing");
    EXPECT_STREQ(Error(ErrorCode::internal, {}).what(), "");
    EXPECT_EQ(plain.path(), "");
    EXPECT_EQ(at_key.path(), "light.half_u");
    EXPECT_EQ(at_key.message(), "is missing");
    EXPECT_EQ(at_key.hint(), "");
}

TEST(Error, PlacesGoInFrontOnce)
{
    const Error error = at_key.within("lights[2]").within("scene.json");
    EXPECT_EQ(error.place(), "scene.json: lights[2]");
    EXPECT_EQ(error.within("scene.json").place(), error.place());
    EXPECT_EQ(error.within("scene").place(), "scene: scene.json: lights[2]");
    EXPECT_EQ(error.path(), "light.half_u");
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
}

TEST(Error, KeysGoInFrontOfThePath)
{
    EXPECT_EQ(at_key.under("scenes[0]").path(), "scenes[0].light.half_u");
    EXPECT_EQ(Error::at(ErrorCode::usage, "[1]", "is 3").under("lights").path(), "lights[1]");
    EXPECT_EQ(plain.under("objects").path(), "objects");
    EXPECT_STREQ(plain.under("objects").what(), "objects: went wrong (expected better)");
    // The place was what the key names.
    const Error named = Error(ErrorCode::not_found, "no such file").within("a.exr").under("receivers.depth");
    EXPECT_EQ(named.place(), "");
    EXPECT_STREQ(named.what(), "receivers.depth: a.exr: no such file");
}

TEST(Error, InAListPathsLeadThroughTheList)
{
    const auto path = [](const char* own, bool occluders) {
        return in_list(Error::at(ErrorCode::unsupported, own, "is wrong", "expected"), 2, occluders).path();
    };
    EXPECT_EQ(path("light", false), "lights[2]");
    EXPECT_EQ(path("light.emission[1]", false), "lights[2].emission[1]");
    EXPECT_EQ(path("lights", false), "lights") << "another key that begins so";
    EXPECT_EQ(path("occluders.depth.front", true), "lights[2].occluders.depth.front");
    for (const char* shared : {"receivers.depth", "objects", "objects[3].mesh"}) EXPECT_EQ(path(shared, true), shared);
    const Error other = in_list(Error::at(ErrorCode::unsupported, "occluders.camera", "is wrong", "expected"), 2, false);
    EXPECT_STREQ(other.what(), "lights[2]: occluders.camera: is wrong (expected)");
    EXPECT_EQ(other.code(), ErrorCode::unsupported);
}

} // namespace
} // namespace penumbra
