// The one place where tinygltf is compiled.
#include <cstdio>
#include <cstring>
#include <fstream>

#include <nlohmann/json.hpp>

#define TINYGLTF_IMPLEMENTATION
#include "io/tiny_gltf.hpp"
