#include "steadyhand/core/shared_library.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace steadyhand {
namespace {

TEST(SharedLibrary, TheFirstThatCanBeLoadedHasFunctionsAndVariables) {
  Result<SharedLibrary> library = SharedLibrary::load({"libnone.so.1", "libm.so.6", "libc.so.6"});
  ASSERT_TRUE(library) << library.error().message;
  EXPECT_EQ(library->name(), "libm.so.6");
  double (*const cosine)(double) = (*library)("cos");
  ASSERT_NE(cosine, nullptr);
  EXPECT_EQ(cosine(0.5), std::cos(0.5));
  const int* const sign = (*library)("signgam");
  EXPECT_EQ(static_cast<const void*>(sign), static_cast<const void*>(&signgam));
  EXPECT_TRUE(library->complete());
}

TEST(SharedLibrary, AnErrorNamesEachThatWasTried) {
  const Result<SharedLibrary> library = SharedLibrary::load({"/none/libone.so.1", "libtwo.so.2"});
  ASSERT_FALSE(library);
  const std::string why = ": cannot open shared object file: No such file or directory";
  EXPECT_EQ(library.error().message, "/none/libone.so.1" + why + "; libtwo.so.2" + why);
}

TEST(SharedLibrary, AnErrorNamesEachMissingFunction) {
  Result<SharedLibrary> library = SharedLibrary::load({"libm.so.6"});
  ASSERT_TRUE(library) << library.error().message;
  for (const char* name : {"cos", "no_cosine", "no_sine"}) (void)(*library)(name);
  const Status complete = library->complete();
  ASSERT_FALSE(complete);
  EXPECT_EQ(complete.error().message, "libm.so.6 does not have no_cosine, no_sine");
}

}  // namespace
}  // namespace steadyhand
