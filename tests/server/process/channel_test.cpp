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
    server::Outbox first, second;
    ASSERT_TRUE(here.send("two", std::array{first.put("first"), second.put("")}));
    Message message;
    ASSERT_EQ(there.receive(message, Channel::Clock::now() + 10s), Channel::Got::message);
    ASSERT_EQ(message.files.size(), 2U);
    EXPECT_EQ(server::copy_of(message.files[0], 5), "first");
    EXPECT_EQ(server::copy_of(message.files[0], 100), "first") << "no more than there is";
    EXPECT_EQ(server::copy_of(message.files[1], 0), "");
}

// The next bytes take the place of the last ones; of those only that which is longer stays, and nobody asks for it.
TEST(SharedBytes, AnOutboxIsUsedAgain)
{
    server::Outbox outbox;
    const int file = outbox.put("a long text");
    const server::Descriptor other(dup(file));
    EXPECT_EQ(server::copy_of(other, 11), "a long text");
    EXPECT_EQ(outbox.put("short"), file);
    EXPECT_EQ(server::copy_of(other, 5), "short");
    const std::string large(std::size_t{5} << 20, 'x');
    outbox.put(large);
    const server::Descriptor third(dup(outbox.put("after")));
    EXPECT_EQ(server::copy_of(third, 100), "after") << "large ones are not kept";
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
