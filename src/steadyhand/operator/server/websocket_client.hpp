#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "steadyhand/operator/server/connection.hpp"
#include "steadyhand/operator/server/stream.hpp"

namespace steadyhand {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Serves a client of the hub; answers 503 if every place is kept.
void serve_websocket(Stream stream, ConnectionsShared& shared, const Address& address, HttpRequest request);

}  // namespace steadyhand
