// Messages whole or not at all, files beside them, and bytes that two processes see.
#include <gtest/gtest.h>

#include <array>
#include <string>

#include "process/channel.hpp"
#include "process/shared_bytes.hpp"

namespace penumbra::test {
namespace {

using namespace std::chrono_literals;
using server::Channel;
using server::Message;

TEST(Channel, GivesWholeMessagesInOrder)
{
    auto [here, there] = Channel::pair();
    const std::string longest(Channel::most_text, 'x');
    for (const std::string& text : {std::string("a"), longest, std::string("b")}) {
        ASSERT_TRUE(here.send(text));
        Message message;
        ASSERT_EQ(there.receive(message, Channel::Clock::now() + 10s), Channel::Got::message);
        EXPECT_EQ(message.text, text);
        EXPECT_TRUE(message.files.empty());
    }
}

TEST(Channel, TooLongIsNoMessage)
{
    auto [here, there] = Channel::pair();
    ASSERT_TRUE(here.send(std::string(Channel::most_text + 1, 'x')));
    Message message;
    EXPECT_EQ(there.receive(message, Channel::Clock::now() + 10s), Channel::Got::ended);
}

TEST(Channel, SaysWhenTheOtherSideIsGoneOrLate)
{
    auto [here, there] = Channel::pair();
    Message message;
    EXPECT_EQ(there.receive(message, Channel::Clock::now() + 1ms), Channel::Got::late);
    here = Channel();
    EXPECT_EQ(there.receive(message, Channel::Clock::now() + 10s), Channel::Got::ended);
    EXPECT_FALSE(there.send("a"));
}

TEST(Channel, FilesGoBesideTheText)
{
    auto [here, there] = Channel::pair();
    const auto first = server::shared_copy("first"), second = server::shared_copy("");
    ASSERT_TRUE(here.send("two", std::array{first.get(), second.get()}));
    Message message;
    ASSERT_EQ(there.receive(message, Channel::Clock::now() + 10s), Channel::Got::message);
    ASSERT_EQ(message.files.size(), 2U);
    EXPECT_EQ(server::copy_of(message.files[0]), "first");
    EXPECT_EQ(server::copy_of(message.files[1]), "");
}

TEST(SharedBytes, AreSeenOnBothSides)
{
    server::SharedBytes bytes(5);
    std::string_view("hello").copy(bytes.data(), 5);
    EXPECT_EQ(std::string_view(bytes), "hello");
    const server::SharedBytes other{server::Descriptor(dup(bytes.descriptor()))};
    EXPECT_EQ(std::string_view(other), "hello");
    bytes.data()[0] = 'j';
    EXPECT_EQ(std::string_view(other), "jello");
    EXPECT_EQ(std::string_view(server::SharedBytes(0)), "");
    EXPECT_EQ(std::string_view(server::SharedBytes()), "");
}

TEST(SharedBytes, MoreThanThereIsIsRefused) { EXPECT_THROW(server::SharedBytes(std::size_t{1} << 62), std::bad_alloc); }

} // namespace
} // namespace penumbra::test
