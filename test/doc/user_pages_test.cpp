// The commands of the pages that a user goes through: README, tutorial and guides.

#include "pages.hpp"

namespace jackal_aic {
namespace {

TEST(UserPages, AreAllFound) { EXPECT_GE(pages(true).size(), 12u); }

INSTANTIATE_TEST_SUITE_P(Pages, Commands, testing::ValuesIn(pages(true)), nameOf);

}  // namespace
}  // namespace jackal_aic
