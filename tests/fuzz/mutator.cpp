#include "fuzz/mutator.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

namespace penumbra::fuzz {
namespace {

// What sizes, offsets and counts break at: around 0, the signs, and the powers of two.
constexpr std::array<std::uint64_t, 20> awkward{0,          1,          2,          7,          0x7f,       0x80,       0xff,
                                                0x100,      0x7fff,     0x8000,     0xffff,     0x10000,    0x7fffffff, 0x80000000,
                                                0xfffffffe, 0xffffffff, 1ull << 32, 1ull << 62, 1ull << 63, ~0ull};

} // namespace

void Mutator::mutate(Input& input, std::size_t max_size)
{
    for (std::size_t changes = 1 + below(8); changes-- > 0;) change(input);
    if (input.size() > max_size) input.resize(max_size);
}

// Short runs more often than long ones.
std::size_t Mutator::run_length(std::size_t most) { return 1 + below(std::min(most, std::size_t{1} << below(11))); }

// Over what is there or between it.
void Mutator::put(Input& input, const Input& piece)
{
    const std::size_t at = below(input.size() + 1);
    if (below(2) == 0) {
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(at), piece.begin(), piece.end());
        return;
    }
    std::copy_n(piece.begin(), std::min(piece.size(), input.size() - at), input.begin() + static_cast<std::ptrdiff_t>(at));
}

// 1, 2, 4 or 8 bytes in either order.
Input Mutator::integer()
{
    std::uint64_t value = awkward[below(awkward.size())];
    if (below(4) == 0) value = random_() >> below(64);
    Input bytes(std::size_t{1} << below(4));
    for (std::uint8_t& byte : bytes) {
        byte = static_cast<std::uint8_t>(value);
        value >>= 8;
    }
    if (below(2) == 0) std::ranges::reverse(bytes);
    return bytes;
}

Input Mutator::digits()
{
    const std::uint64_t value = awkward[below(awkward.size())];
    const std::string text = (below(3) == 0 ? "-" : "") + std::to_string(value) + (below(4) == 0 ? "e" + std::to_string(below(400)) : "");
    return {text.begin(), text.end()};
}

Input Mutator::foreign_piece()
{
    const Input& other = corpus_[below(corpus_.size())];
    if (other.empty()) return {};
    const std::size_t at = below(other.size());
    const auto begin = other.begin() + static_cast<std::ptrdiff_t>(at);
    return {begin, begin + static_cast<std::ptrdiff_t>(std::min(run_length(1024), other.size() - at))};
}

void Mutator::change(Input& input)
{
    const std::size_t at = below(input.size());
    const std::size_t length = input.empty() ? 0 : std::min(run_length(1024), input.size() - at);
    const auto begin = input.begin() + static_cast<std::ptrdiff_t>(at), end = begin + static_cast<std::ptrdiff_t>(length);
    const Input run(begin, end);
    switch (below(10)) {
    case 0:
        if (!input.empty()) input[at] ^= static_cast<std::uint8_t>(1u << below(8));
        break;
    case 1:
        if (!input.empty()) input[at] = static_cast<std::uint8_t>(random_());
        break;
    case 2:
        input.erase(begin, end);
        break;
    case 3: // doubled, up to 64 times
        for (std::size_t times = 1 + below(below(8) == 0 ? 64 : 2); times-- > 0 && input.size() < (std::size_t{1} << 20);)
            input.insert(input.begin() + static_cast<std::ptrdiff_t>(at), run.begin(), run.end());
        break;
    case 4: // moved
        input.erase(begin, end);
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(below(input.size() + 1)), run.begin(), run.end());
        break;
    case 5:
        put(input, integer());
        break;
    case 6:
        put(input, digits());
        break;
    case 7:
        put(input, tokens_.empty() ? integer() : tokens_[below(tokens_.size())]);
        break;
    case 8:
        put(input, foreign_piece());
        break;
    default: // the first part of this one, the last of another; or cut off
        input.resize(at);
        if (below(4) != 0) {
            const Input& other = corpus_[below(corpus_.size())];
            input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(std::min(at, other.size())), other.end());
        }
        break;
    }
}

std::vector<Input> read_dictionary(const std::string& path)
{
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    std::vector<Input> tokens;
    std::string line;
    for (int number = 1; std::getline(file, line); ++number) {
        if (line.empty() || line.front() == '#') continue;
        const std::size_t begin = line.find('"'), end = line.rfind('"');
        const auto broken = [&] { return std::runtime_error(path + ":" + std::to_string(number) + ": expected name=\"text\""); };
        if (begin == std::string::npos || end == begin) throw broken();
        Input token;
        for (std::size_t i = begin + 1; i < end; ++i) {
            if (line[i] != '\\') {
                token.push_back(static_cast<std::uint8_t>(line[i]));
            } else if (line[i + 1] == 'x') {
                if (i + 3 >= end) throw broken();
                token.push_back(static_cast<std::uint8_t>(std::stoul(line.substr(i + 2, 2), nullptr, 16)));
                i += 3;
            } else {
                token.push_back(static_cast<std::uint8_t>(line[++i]));
            }
        }
        tokens.push_back(std::move(token));
    }
    return tokens;
}

} // namespace penumbra::fuzz
