#pragma once

#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

#include "steadyhand/operator/server/connection.hpp"
#include "steadyhand/operator/server/stream.hpp"

namespace steadyhand {

using HttpRequest = boost::beast::http::request<boost::beast::http::empty_body>;

/// Goes on as a client of the hub; answered with 503 where every place is kept.
void serve_websocket(Stream stream, ConnectionsShared& shared, const Address& address, HttpRequest request);

}  // namespace steadyhand
