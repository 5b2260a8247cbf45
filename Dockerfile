# Web app first: its output is carried inside the Python package
FROM node:20.19-bookworm-slim AS web
WORKDIR /src
RUN npm install --global npm@11
COPY web/package.json web/package-lock.json web/
RUN cd web && npm ci
COPY web web
RUN cd web && npm run build

FROM python:3.11-slim-bookworm
WORKDIR /src
COPY pyproject.toml constraints.txt README.md ./
COPY server server
COPY migrations migrations
COPY --from=web /src/server/stillroom/static server/stillroom/static
RUN pip install --no-cache-dir --constraint constraints.txt '.[postgresql]' \
    && useradd --system --home-dir /var/lib/stillroom --create-home stillroom
USER stillroom
ENV STILLROOM_DATA_DIR=/var/lib/stillroom
VOLUME /var/lib/stillroom
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s CMD ["python", "-c", "import urllib.request; urllib.request.urlopen('http://127.0.0.1:8000/readyz', timeout=2)"]
CMD ["stillroom", "serve", "--host", "0.0.0.0", "--port", "8000"]
