// The scene file, version 1, described once as data: every object, its keys, what they may be and what they mean. The parser's checks, the
// JSON Schema, the tables of docs/scene_file.md and the places of file names are made from this. A technique's keys stand in its own row
// (technique/table.hpp).
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace penumbra::scene_file {

struct Object;

// --- What a value may be ---------------------------------------------------------------------------------------------------------

struct Constant { // this number, or this string: the kind that decides an object's form
    std::variant<int, std::string_view> value;
};
// No number is larger: squares of lengths, and products of three, stay within binary32.
constexpr double largest = 1e12;
// No camera's half angle has a larger tangent (89.99 degrees).
constexpr double largest_tangent = 1e4;
struct Number { // the ends of the range belong to it unless it lies above or below them
    double low = -largest, high = largest;
    bool above_low = false, below_high = false;
};
struct OneOfIntegers {
    std::vector<int> values;
};
struct Boolean {};
struct Text {                      // not empty, no control characters
    std::string_view pattern = {}; // ECMA 262; empty: any
};
// A list's upper end that is none.
constexpr std::size_t any_number = std::numeric_limits<std::size_t>::max();
struct File {}; // the name of a file, or of a part of a request
struct Files {  // a list of them
    std::size_t low, high;
    bool or_one; // may be one file instead of a list
};
struct FileTable {}; // an object of files, by names that are free
struct Numbers { // a vector or matrix of that many, each within `largest`
    std::size_t count;
};
struct LengthOrAuto {}; // a number above 0 and up to `largest`, or "auto"
struct NameOrNumber {}; // a text, or a whole number from 0
struct Pair { // [x, y], or one number for both; above 0
    double high = largest;
};
struct Size {   // [width, height]
    std::int64_t low, high;
};
struct One { // an object
    const Object& (*object)();
};
struct List { // of objects
    const Object& (*object)();
    std::size_t low, high;
};
struct TechniqueKeys {}; // a kind of technique_table() and its settings

using Type = std::variant<Constant, Number, OneOfIntegers, Boolean, Text, File, Files, FileTable, Numbers, LengthOrAuto, NameOrNumber, Pair, Size, One, List, TechniqueKeys>;

// --- Keys, forms, objects --------------------------------------------------------------------------------------------------------

struct Key {
    std::string_view name;
    Type type;
    std::string_view meaning;
    std::string_view unit = {};      // "length", "degrees"
    bool required = false;           //
    std::string_view fallback = {};  // as JSON: what the key is when it is left out
    std::string_view otherwise = {}; // in words: the same, where it is no fixed value
    std::string_view example = {};   // as JSON
};

// An object's keys. Where it has several forms, its kind or the keys that it has decide.
struct Form {
    std::string_view name; // "rectangle"
    std::string_view of;   // what an unknown key is no key of: "of a rectangle"; empty: nothing is said
    std::string_view meaning;
    std::vector<Key> keys;
    std::vector<std::string_view> exactly_one = {}; // of these keys
};

struct Object {
    std::string_view name; // "light"
    std::string_view meaning;
    std::vector<Form> forms;
};

// The key whose value decides an object's form.
Key kind(std::string_view name);

// An object of one form, `exactly_one` being the form's.
Object of_one_form(std::string_view name, std::string_view meaning, std::vector<Key> keys, std::vector<std::string_view> exactly_one = {});

const Object& scene();
const Object& light();        // forms in the order of the variant Light
const Object& listed_light(); // of `lights`: the same with keys of its own
const Object& object();
const Object& quad();
const Object& occluders();
const Object& occluder_depth();
const Object& receivers();
const Object& camera();
const Object& intrinsics();
const Object& anchor();
const Object& encoding(); // forms in the order of EncodingKind
const Object& output();

// Every object above, each once, the scene first.
std::span<const Object* const> objects();

// Forms of objects that no kind tells apart, by their place.
enum CameraForm { light_camera_form, sun_camera_form, looking_camera_form, matrix_camera_form };
enum ObjectForm { mesh_form, quad_form, depth_form };

// --- What is made from them ------------------------------------------------------------------------------------------------------

// The kind that a form asks for; empty: none.
std::string_view kind_of(const Form& form);

// The first key of that name in an object's forms, which has to be there.
const Key& key_of(const Object& object, std::string_view name);

// The names of an object's kinds, each once.
std::vector<std::string_view> kinds_of(const Object& object);

// "a number above 0", "one of 8, 16, 32": what a message expects.
std::string expected(const Number& number);
std::string expected(const OneOfIntegers& integers);

// Where file names stand: "lights[].emission[]", [] being each element of a list and {} each member of a table.
const std::vector<std::string>& file_places();

} // namespace penumbra::scene_file
