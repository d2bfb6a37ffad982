#include "steadyhand/operator/protocol/episodes.hpp"

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
  EXPECT_EQ(episodes.view(from_seconds(4.0)).kept, 0) << "who knows whether it is recorded";
  EXPECT_EQ(episodes.take(said(Said::kBegin, 5.0), {})->episode, 2);
  EXPECT_EQ(episodes.take(said(Said::kDiscard, 6.0), {})->success, std::nullopt);
  for (const auto& [episode, kind] :
       {std::pair(1, Said::kBegin), {1, Said::kKeep}, {2, Said::kBegin}, {2, Said::kDiscard}}) {
    EXPECT_FALSE(episodes.settle({episode, kind, true}, from_seconds(7.0)));
  }
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
  (void)episodes.settle({1, Said::kKeep, true}, from_seconds(3.0));
  EXPECT_EQ(episodes.view(from_seconds(4.0)).kept, 1);
  (void)episodes.take(said(Said::kDiscard, 5.0), true);  // thought better of
  (void)episodes.settle({1, Said::kDiscard, true}, from_seconds(5.0));
  EXPECT_EQ(episodes.view(from_seconds(6.0)).kept, 0);
  EXPECT_EQ(episodes.view(from_seconds(6.0)).discarded, 1);
}

/// A later request does not change that: what is not recorded is in no data set.
TEST(Episodes, OneThatIsNotRecordedIsLost) {
  Episodes episodes;
  (void)episodes.take(said(Said::kBegin, 1.0), {});
  EXPECT_TRUE(episodes.settle({1, Said::kBegin, false}, from_seconds(3.0)));
  EXPECT_FALSE(episodes.settle({1, Said::kKeep, false}, from_seconds(4.0))) << "it is counted once";
  EpisodeView view = episodes.view(from_seconds(9.0));
  EXPECT_FALSE(view.running);
  EXPECT_EQ(view.time, 2.0);
  EXPECT_EQ(view.lost, 1);
  for (const Said kind : {Said::kKeep, Said::kDiscard, Said::kMark}) {
    const auto late = episodes.take(said(kind, 5.0), true);
    ASSERT_FALSE(late);
    EXPECT_EQ(late.error().message, "episode 1 is lost: its recording ended before it was kept; begin another");
  }

  // The next one runs already when it is known that this one's end is not recorded.
  (void)episodes.take(said(Said::kBegin, 6.0), {});
  (void)episodes.take(said(Said::kKeep, 7.0), {});
  (void)episodes.take(said(Said::kBegin, 7.5), {});
  EXPECT_TRUE(episodes.settle({2, Said::kKeep, false}, from_seconds(8.0)));
  view = episodes.view(from_seconds(9.0));
  EXPECT_TRUE(view.running);
  EXPECT_EQ(view.kept, 0);
  EXPECT_EQ(view.lost, 2);

  // If a changed decision is not recorded, the recording's earlier one stays.
  (void)episodes.take(said(Said::kKeep, 9.0), {});
  (void)episodes.settle({3, Said::kKeep, true}, from_seconds(9.0));
  (void)episodes.take(said(Said::kDiscard, 10.0), {});
  EXPECT_FALSE(episodes.settle({3, Said::kDiscard, false}, from_seconds(10.0)));
  view = episodes.view(from_seconds(11.0));
  EXPECT_EQ(view.kept, 1);
  EXPECT_EQ(view.discarded, 0);
}

}  // namespace
}  // namespace steadyhand
