// Changes to an input, drawn from a seed: the same seed makes the same changes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace penumbra::fuzz {

using Input = std::vector<std::uint8_t>;

class Mutator {
public:
    // `corpus` is what pieces are taken from, `tokens` are words of the format. Both outlive this object.
    Mutator(const std::vector<Input>& corpus, const std::vector<Input>& tokens, std::uint64_t seed)
        : corpus_(corpus), tokens_(tokens), random_(seed)
    {
    }

    // One to eight changes: bits turned, bytes set, runs inserted, taken out, doubled or moved, integers that programs trip over, words of
    // the format, pieces of other inputs. At most `max_size` bytes are left.
    void mutate(Input& input, std::size_t max_size);

    // Below `n`; 0 for none.
    std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random_() % n); }

private:
    void change(Input& input);
    void put(Input& input, const Input& piece);
    Input integer();
    Input digits();
    Input foreign_piece();
    std::size_t run_length(std::size_t most);

    const std::vector<Input>& corpus_;
    const std::vector<Input>& tokens_;
    std::mt19937_64 random_;
};

// The words of a dictionary in libFuzzer's form: name="text", with \xNN, \\ and \"; # begins a comment. Throws std::runtime_error with the
// line.
std::vector<Input> read_dictionary(const std::string& path);

} // namespace penumbra::fuzz
