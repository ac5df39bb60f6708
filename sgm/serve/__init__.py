"""The calls of a `MemoryService` for other processes: HTTP with JSON, and tools of MCP."""
