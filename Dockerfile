# The server of a memory, docs/serve.md:
#   docker build --tag sgm . && docker run --env SGM_TOKEN --volume sgm:/home/sgm --publish 8600:8600 sgm
# or, with compose.yaml: docker compose up --build
FROM python:3.13-slim
WORKDIR /source
COPY constraints.txt README.md LICENSE NOTICE ./
COPY core core
COPY sgm sgm
RUN pip install --no-cache-dir --constraint constraints.txt './core[serve]'
RUN useradd --create-home sgm
USER sgm
WORKDIR /home/sgm
VOLUME /home/sgm
EXPOSE 8600
HEALTHCHECK --interval=30s --timeout=5s --start-period=30s CMD ["python", "-c", \
  "from urllib.request import urlopen; urlopen('http://127.0.0.1:8600/health', timeout=4)"]
ENTRYPOINT ["sgm-serve"]
CMD ["home.sgm", "--new", "--host", "0.0.0.0"]
