#define CATCH_CONFIG_MAIN  // read by Catch2 2; version 3 brings its main in a library
#include <catch2/catch.hpp>
