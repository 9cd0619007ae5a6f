// Prints every specialisation of every kernel file, one a line, for the build's offline compile.
#include <iostream>

#include "technique/techniques.hpp"

int main()
{
    for (const auto& s : penumbra::every_specialisation()) std::cout << s.file << ' ' << s.options() << '\n';
}
