// What the command writes to standard output and standard error.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace penumbra::cli {

// A result, to standard output, flushed. Throws output when it does not get there (a full disk, a closed pipe).
void print(std::string_view text);

// "penumbra: <what>" as one line on standard error; control characters become spaces.
void print_error(std::string_view what);
void print_warnings(const std::vector<std::string>& warnings, std::string_view where = {});

// Whether standard error is a terminal that can redraw a line, and how many columns it has.
bool on_terminal();
std::size_t terminal_columns();

// Redraws the last line of the terminal; "" clears it. Nothing when standard error is not a terminal.
void draw_line(std::string_view text);

} // namespace penumbra::cli
