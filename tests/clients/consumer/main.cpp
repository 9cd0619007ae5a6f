// Two sources, so that what is not inline is found. Asks a service that is not there.
#include <iostream>

#include <penumbra/client.hpp>

int main(int, char** arguments)
{
    try {
        const penumbra::client::Client service(arguments[1], {.timeout = std::chrono::seconds(10), .retries = 0});
        std::cout << service.ready() << "\n";
        return 1;
    } catch (const penumbra::client::ConnectionFailed& error) {
        std::cout << error.problem().reason << "\n";
    }
}
