{{/* Names, labels, and what the pods have in common. */}}

{{- define "meshcone.name" -}}
{{- if contains .Chart.Name .Release.Name -}}
{{- .Release.Name | trunc 50 | trimSuffix "-" -}}
{{- else -}}
{{- printf "%s-%s" .Release.Name .Chart.Name | trunc 50 | trimSuffix "-" -}}
{{- end -}}
{{- end -}}

{{- define "meshcone.serviceAccount" -}}
{{- .Values.serviceAccount.name | default (include "meshcone.name" .) -}}
{{- end -}}

{{- define "meshcone.selector" -}}
app.kubernetes.io/name: meshcone
app.kubernetes.io/instance: {{ .root.Release.Name }}
app.kubernetes.io/component: {{ .component }}
{{- end -}}

{{- define "meshcone.labels" -}}
{{ include "meshcone.selector" . }}
app.kubernetes.io/version: {{ .root.Chart.AppVersion | quote }}
app.kubernetes.io/managed-by: {{ .root.Release.Service }}
helm.sh/chart: {{ printf "%s-%s" .root.Chart.Name .root.Chart.Version | replace "+" "_" }}
{{- end -}}

{{/* Start of each Deployment's pod. Takes root, component, values, grace (seconds) and files. */}}
{{- define "meshcone.pod" -}}
metadata:
  labels:
    {{- include "meshcone.labels" . | nindent 4 }}
  annotations:
    checksum/settings: {{ include (print .root.Template.BasePath "/settings.yaml") .root | sha256sum }}
    {{- with .values.podAnnotations }}
    {{- toYaml . | nindent 4 }}
    {{- end }}
spec:
  serviceAccountName: {{ include "meshcone.serviceAccount" .root }}
  automountServiceAccountToken: false
  enableServiceLinks: false
  terminationGracePeriodSeconds: {{ .grace }}
  {{- with .root.Values.image.pullSecrets }}
  imagePullSecrets:
    {{- toYaml . | nindent 4 }}
  {{- end }}
  securityContext:
    runAsNonRoot: true
    runAsUser: 10001
    runAsGroup: 10001
    fsGroup: 10001
    fsGroupChangePolicy: OnRootMismatch
    seccompProfile:
      type: RuntimeDefault
  {{- with .values.nodeSelector }}
  nodeSelector:
    {{- toYaml . | nindent 4 }}
  {{- end }}
  {{- with .values.tolerations }}
  tolerations:
    {{- toYaml . | nindent 4 }}
  {{- end }}
  {{- with .values.affinity }}
  affinity:
    {{- toYaml . | nindent 4 }}
  {{- end }}
  volumes:
    - name: temporary
      emptyDir:
        sizeLimit: {{ .values.temporary }}
    - name: data
      {{- if and .files .root.Values.files.existingClaim }}
      persistentVolumeClaim:
        claimName: {{ .root.Values.files.existingClaim }}
      {{- else }}
      emptyDir:
        sizeLimit: 64Mi
      {{- end }}
{{- end -}}

{{/* What every container has but its command and probes. Takes root, values and outbound. */}}
{{- define "meshcone.container" -}}
image: {{ printf "%s:%s" .root.Values.image.repository (.root.Values.image.tag | default .root.Chart.AppVersion) | quote }}
imagePullPolicy: {{ .root.Values.image.pullPolicy }}
securityContext:
  allowPrivilegeEscalation: false
  readOnlyRootFilesystem: true
  capabilities:
    drop: [ALL]
envFrom:
  - configMapRef:
      name: {{ include "meshcone.name" .root }}
  - secretRef:
      name: {{ required "secret: name a Secret with MESHCONE_REDIS_URL" .root.Values.secret }}
  {{- if and .outbound .root.Values.outboundSecret }}
  - secretRef:
      name: {{ .root.Values.outboundSecret }}
  {{- end }}
volumeMounts:
  - name: temporary
    mountPath: /tmp
  - name: data
    mountPath: /data
resources:
  {{- toYaml .values.resources | nindent 2 }}
{{- end -}}
