#include "steadyhand/desk/episodes.hpp"

#include <gtest/gtest.h>

namespace steadyhand {
namespace {

using Said = EpisodeMark::Kind;

EpisodeMark said(Said kind, double t, std::optional<bool> success = {}) {
  EpisodeMark mark;
  mark.kind = kind;
  mark.at = from_seconds(t);
  mark.success = success;
  return mark;
}

TEST(Episodes, AreNumberedAndCounted) {
  Episodes episodes;
  EXPECT_FALSE(episodes.take(said(Said::kKeep, 1.0), {}));
  EXPECT_EQ(episodes.take(said(Said::kBegin, 1.0), {})->episode, 1);
  EXPECT_TRUE(episodes.view(from_seconds(3.0)).running);
  EXPECT_EQ(episodes.view(from_seconds(3.0)).time, 2.0);
  const auto twice = episodes.take(said(Said::kBegin, 3.0), {});
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().message, "episode 1 is running; keep or discard it first");
  EXPECT_EQ(episodes.take(said(Said::kKeep, 4.0), true)->success, true);  // as the task ended
  EXPECT_EQ(episodes.take(said(Said::kBegin, 5.0), {})->episode, 2);
  EXPECT_EQ(episodes.take(said(Said::kDiscard, 6.0), {})->success, std::nullopt);
  const EpisodeView view = episodes.view(from_seconds(9.0));
  EXPECT_FALSE(view.running);
  EXPECT_EQ(view.kept, 1);
  EXPECT_EQ(view.discarded, 1);
  EXPECT_EQ(view.time, 1.0);
}

TEST(Episodes, WhatPeopleSayCountsMoreThanTheTask) {
  Episodes episodes;
  (void)episodes.take(said(Said::kBegin, 1.0), {});
  EXPECT_EQ(episodes.take(said(Said::kMark, 2.0, false), true)->success, false);
  EXPECT_EQ(episodes.take(said(Said::kKeep, 3.0), true)->success, std::nullopt);  // which leaves the word before
  EXPECT_EQ(episodes.view(from_seconds(4.0)).success, false);
  (void)episodes.take(said(Said::kDiscard, 5.0), true);  // thought better of
  EXPECT_EQ(episodes.view(from_seconds(6.0)).kept, 0);
  EXPECT_EQ(episodes.view(from_seconds(6.0)).discarded, 1);
}

}  // namespace
}  // namespace steadyhand
