// Headers of others that nearly every file reads: compiled once. Every file includes what it uses all the same, so that it compiles without
// this one (CMAKE_DISABLE_PRECOMPILE_HEADERS).
//
// Not nlohmann/json.hpp or CL/opencl.hpp: with g++ 12 a precompiled header brings its pending templates along, and an empty file that reads
// json.hpp this way still takes 1.8 s (4.2 s without); these headers take 0.7 s together (2.0 s without).
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
